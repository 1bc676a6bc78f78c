"""Encoder and sampled controller, for all lanes of a world at once."""

import numpy as np

from clie_blocks.analysis.blind.engine.chance import LaneRandom
from clie_blocks.analysis.blind.engine.delay_line import DelayLine
from clie_blocks.analysis.blind.engine.parameters import G, Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot


class SampledEncoder:
    """What the encoder reports: off zero, eccentric, noisy, rounded to its own step and the log's.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.
    duration : ndarray, shape (lanes, 1)
        Length of each experiment [s].
    random : LaneRandom
        Source of chance.

    """

    LOSSES = 6  # times that counts are lost in an experiment

    def __init__(self, robot: DrawnRobot, p: Parameters, duration: np.ndarray,
                 random: LaneRandom) -> None:
        self.shaft, self.phase, self.resolution = robot.shaft, p["phase"], robot.resolution
        self.step = np.maximum(robot.resolution, p["step"])
        self.coarse = bool(np.any(self.step > robot.resolution))
        self.eccentric = p["eccentric"] if p["eccentric"].any() else None
        self.zero = p["zero"] if p["zero"].any() else None
        self.lost = p["lost_counts"] if p["lost_counts"].any() else None
        if self.lost is not None:
            self.losses = [(duration * random("random"), np.sign(random("standard_normal")))
                           for _ in range(self.LOSSES)]

    def __call__(self, t: float, q: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Angle that the controller reads and the log keeps, shape (lanes, n) [rad]."""
        measured = q + noise
        if self.zero is not None:
            measured += self.zero
        if self.lost is not None:
            measured += self.lost * sum(sign * (t > at) for at, sign in self.losses)
        if self.eccentric is not None:
            measured += self.eccentric * np.sin(self.shaft * q + self.phase)
        if self.coarse:
            measured = np.rint(measured / self.step) * self.step
        return np.rint(measured / self.resolution) * self.resolution


class SecondEncoder:
    """What an encoder on the other side of the gear reports: noisy, rounded as the first one.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    random : LaneRandom
        Source of chance.

    """

    def __init__(self, robot: DrawnRobot, random: LaneRandom) -> None:
        self.sigma, self.resolution, self.random = robot.sigma, robot.resolution, random

    def __call__(self, q: np.ndarray) -> np.ndarray:
        """Angle that the log keeps, shape (lanes, n) [rad]."""
        measured = q + self.sigma * self.random("standard_normal")
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


class SampledFilter:
    """Second-order filter, at rest before the first sample."""

    def __init__(self, b: list[np.ndarray], a: list[np.ndarray]) -> None:
        self.b, self.a = b, a
        self.first: np.ndarray | float = 0.0
        self.second: np.ndarray | float = 0.0

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Next value."""
        b, a = self.b, self.a
        y = b[0] * x + self.first
        self.first = b[1] * x - a[1] * y + self.second
        self.second = b[2] * x - a[2] * y
        return y


class SetPoint:
    """What the law sees of the set-point: late, and no faster than its limiter lets it be.

    Parameters
    ----------
    period : float
        Sample time [s].
    p : dict of ndarray, shape (lanes, n)
        True parameters.

    """

    def __init__(self, period: float, p: Parameters) -> None:
        self.most = period * p["slew"] if np.isfinite(p["slew"]).any() else None
        self.delay = p["reference_delay"] if p["reference_delay"].any() else None
        self.line = DelayLine(p["reference_delay"].max(), period)
        self.now: np.ndarray | None = None

    def __call__(self, q_d: np.ndarray) -> np.ndarray:
        """Set-point of the law, shape (lanes, n) [rad]."""
        if self.delay is not None:
            self.line.append(q_d)
            q_d = self.line.between(self.delay)
        if self.most is not None:
            before = q_d if self.now is None else self.now
            q_d = self.now = before + np.clip(q_d - before, -self.most, self.most)
        return q_d


class SampledController:
    """PD law with the velocity filter G1, at rest before the first sample.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.

    """

    def __init__(self, robot: DrawnRobot, p: Parameters) -> None:
        high, low = (p["corner"] * corner for corner in robot.corners)
        coefficients = filter_coefficients(high, low, robot.period, robot.discretisation)
        self.velocity, self.p = SampledFilter(*coefficients), p
        self.kp, self.kd = robot.kp * p["kp_factor"], robot.kd * p["kd_factor"]
        self.step = robot.command_step
        self.integral = robot.period * p["integral"] if p["integral"].any() else None
        self.behind = p["behind"] > 0 if p["behind"].any() else None
        self.set_point = SetPoint(robot.period, p)
        self.stale = p["stale"] if p["stale"].any() else None
        self.line = DelayLine(p["stale"].max(), robot.period)
        self.reference = SampledFilter(*coefficients) if p["reference_speed"].any() else None
        self.lags = bool(p["estimate_lag"].any())
        with np.errstate(divide="ignore"):
            self.follow = 1 - np.exp(-robot.period / p["estimate_lag"])
        self.compensates = p["compensated_weight"].any() or p["compensated_friction"].any()
        self.robot, self.carries = robot, p["carried_links"].any()
        self.start: np.ndarray | None = None
        self.first_q_d: np.ndarray | None = None
        self.previous: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self.lagging: np.ndarray | float = 0.0  # velocity behind its lag [rad/s]
        self.sum: np.ndarray | float = 0.0  # integral part [N m]

    def __call__(self, q_d: np.ndarray, q: np.ndarray, pe: np.ndarray) -> np.ndarray:
        """Command, rounded, shape (lanes, n) [N m]."""
        if self.behind is not None:
            now = q_d, q, pe
            before = self.previous or now
            q_d, q, pe = (np.where(self.behind, *pair) for pair in zip(before, now))
            self.previous = now
        q_d = self.set_point(q_d)
        if self.stale is not None:
            self.line.append(q)
            q = self.line.between(self.stale)
        if self.start is None:
            self.start, self.first_q_d = q, q_d
        speed = self._speed(q)
        u = self.kp * (q_d - q) - self.kd * speed + pe
        if self.integral is not None:
            self.sum = self.sum + self.integral * (q_d - q)
            u += self.sum
        if self.reference is not None:
            wanted = self.reference(q_d - self.first_q_d)
            u += self.p["reference_speed"] * self.kd * wanted
        if self.compensates:
            u += self._compensation(q, speed)
        if self.carries:
            u += self._weight(q)
        return np.rint(u / self.step) * self.step

    def _speed(self, q: np.ndarray) -> np.ndarray:
        """Speed that the law uses [rad/s]."""
        speed = self.velocity(q - self.start)
        if not self.lags:
            return speed
        self.lagging = self.lagging + self.follow * (speed - self.lagging)
        return self.lagging

    def _weight(self, q: np.ndarray) -> np.ndarray:
        """Torque of the motors that holds the links of a chain in one vertical plane."""
        robot, mass = self.robot, self.p["carried_links"] * self.robot.mass
        behind = np.cumsum(mass[:, ::-1], axis=1)[:, ::-1] - mass
        moment = G * (mass * robot.com + robot.length * behind) * np.cos(np.cumsum(q, axis=1))
        return np.cumsum(moment[:, ::-1], axis=1)[:, ::-1] / robot.ratio

    def _compensation(self, q: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """What the drive adds of its own: a weight at the joint's angle, friction by its speed."""
        p = self.p
        return (p["compensated_weight"] * np.cos(q)
                + p["compensated_friction"] * np.tanh(speed / p["compensated_speed"]))
