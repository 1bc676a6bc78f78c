"""Encoder and sampled controller, for all lanes of a world at once."""

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot


class SampledEncoder:
    """What the encoder reports: eccentric, noisy, rounded to its own step and to the log's.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.

    """

    def __init__(self, robot: DrawnRobot, p: dict[str, np.ndarray]) -> None:
        self.shaft, self.phase, self.resolution = robot.shaft, p["phase"], robot.resolution
        self.step = np.maximum(robot.resolution, p["step"])
        self.coarse = bool(np.any(self.step > robot.resolution))
        self.eccentric = p["eccentric"] if p["eccentric"].any() else None

    def __call__(self, q: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Angle that the controller reads and the log keeps, shape (lanes, n) [rad]."""
        measured = q + noise
        if self.eccentric is not None:
            measured += self.eccentric * np.sin(self.shaft * q + self.phase)
        if self.coarse:
            measured = np.rint(measured / self.step) * self.step
        return np.rint(measured / self.resolution) * self.resolution


def filter_coefficients(high: np.ndarray, low: np.ndarray, period: float,
                        discretisation: str) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Sampled form of ``high s / (s + high)  low / (s + low)`` as b, a, each three arrays.

    Parameters
    ----------
    high, low : ndarray
        Corners [rad/s], different ones.
    period : float
        Sample time [s].
    discretisation : str
        ``tustin``, ``backward``, ``zoh`` behind a hold, or ``matched`` poles and zeros.

    """
    one, zero = np.ones_like(high, float), np.zeros_like(high, float)
    if discretisation in ("zoh", "matched"):
        e_high, e_low = np.exp(-high * period), np.exp(-low * period)
        a = [one, -e_high - e_low, e_high * e_low]
        if discretisation == "matched":
            gain = (1 - e_high) * (1 - e_low) / period
            return [gain, -gain, zero], a
        gain = high * low * (e_low - e_high) / (high - low)
        return [zero, gain, -gain], a
    half = period / 2 if discretisation == "tustin" else period
    back = half if discretisation == "tustin" else 0.0  # weight of the sample before
    scale = 1 / ((1 + high * half) * (1 + low * half))
    b = [scale * high * low * x for x in (half, back - half, -back)]
    first, second = high * back - 1, low * back - 1
    return b, [one, scale * ((1 + high * half) * second + (1 + low * half) * first),
               scale * first * second]


class SampledController:
    """PD law with the velocity filter G1, at rest before the first sample.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.

    """

    def __init__(self, robot: DrawnRobot, p: dict[str, np.ndarray]) -> None:
        high, low = (p["corner"] * corner for corner in robot.corners)
        self.b, self.a = filter_coefficients(high, low, robot.period, robot.discretisation)
        self.kp, self.kd, self.step = robot.kp * p["kp_factor"], robot.kd, robot.command_step
        self.integral = robot.period * p["integral"] if p["integral"].any() else None
        self.behind = p["behind"] > 0 if p["behind"].any() else None
        self.start: np.ndarray | None = None
        self.previous: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self.first: np.ndarray | float = 0.0  # the two states of the velocity filter
        self.second: np.ndarray | float = 0.0
        self.sum: np.ndarray | float = 0.0  # integral part [N m]

    def __call__(self, q_d: np.ndarray, q: np.ndarray, pe: np.ndarray) -> np.ndarray:
        """Command, rounded, shape (lanes, n) [N m]."""
        if self.behind is not None:
            now = q_d, q, pe
            before = self.previous or now
            q_d, q, pe = (np.where(self.behind, *pair) for pair in zip(before, now))
            self.previous = now
        if self.start is None:
            self.start = q
        u = self.kp * (q_d - q) - self.kd * self._velocity(q - self.start) + pe
        if self.integral is not None:
            self.sum = self.sum + self.integral * (q_d - q)
            u += self.sum
        return np.rint(u / self.step) * self.step

    def _velocity(self, x: np.ndarray) -> np.ndarray:
        b, a = self.b, self.a
        velocity = b[0] * x + self.first
        self.first = b[1] * x - a[1] * velocity + self.second
        self.second = b[2] * x - a[2] * velocity
        return velocity
