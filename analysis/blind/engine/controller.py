"""Encoder and sampled controller, for all lanes of a world at once."""

import numpy as np


class Encoder:
    """What the encoder says: eccentric, noisy, rounded to its own step and to the log's."""

    def __init__(self, robot, p):
        self.shaft, self.phase, self.resolution = robot.shaft, p["phase"], robot.resolution
        self.step = np.maximum(robot.resolution, p["step"])
        self.coarse = bool(np.any(self.step > robot.resolution))
        self.eccentric = p["eccentric"] if p["eccentric"].any() else None

    def __call__(self, q, noise):
        """Angle that the controller reads and the log keeps [rad]."""
        seen = q + noise
        if self.eccentric is not None:
            seen += self.eccentric * np.sin(self.shaft * q + self.phase)
        if self.coarse:
            seen = np.rint(seen / self.step) * self.step
        return np.rint(seen / self.resolution) * self.resolution


def filter_coefficients(high, low, period, discretisation):
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
    if discretisation in ("zoh", "matched"):
        e_high, e_low = np.exp(-high * period), np.exp(-low * period)
        a = [1.0, -e_high - e_low, e_high * e_low]
        if discretisation == "matched":
            gain = (1 - e_high) * (1 - e_low) / period
            return [gain, -gain, 0.0], a
        gain = high * low * (e_low - e_high) / (high - low)
        return [0.0, gain, -gain], a
    half = period / 2 if discretisation == "tustin" else period
    back = half if discretisation == "tustin" else 0.0  # weight of the sample before
    scale = 1 / ((1 + high * half) * (1 + low * half))
    b = [scale * high * low * x for x in (half, back - half, -back)]
    first, second = high * back - 1, low * back - 1
    return b, [1.0, scale * ((1 + high * half) * second + (1 + low * half) * first),
               scale * first * second]


class Controller:
    """PD law with the velocity filter G1, at rest before the first sample."""

    def __init__(self, robot, p):
        high, low = (p["corner"] * corner for corner in robot.corners)
        self.b, self.a = filter_coefficients(high, low, robot.period, robot.discretisation)
        self.kp, self.kd, self.step = robot.kp * p["kp_factor"], robot.kd, robot.command_step
        self.integral = robot.period * p["integral"] if p["integral"].any() else None
        self.behind = p["behind"] > 0 if p["behind"].any() else None
        self.begin, self.first, self.second, self.sum, self.before = None, 0.0, 0.0, 0.0, None

    def __call__(self, q_d, q, pe):
        """Command [N m], rounded."""
        if self.behind is not None:
            now, before = (q_d, q, pe), self.before or (q_d, q, pe)
            q_d, q, pe = (np.where(self.behind, *pair) for pair in zip(before, now))
            self.before = now
        if self.begin is None:
            self.begin = q
        b, a, x = self.b, self.a, q - self.begin
        speed = b[0] * x + self.first
        self.first = b[1] * x - a[1] * speed + self.second
        self.second = b[2] * x - a[2] * speed
        u = self.kp * (q_d - q) - self.kd * speed + pe
        if self.integral is not None:
            self.sum = self.sum + self.integral * (q_d - q)
            u += self.sum
        return np.rint(u / self.step) * self.step
