"""Torques of a load that the engine has no part for, motor side [N m], opposing the motion."""

import numpy as np

from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot

_AT, _WEIGHT = (x / 2 for x in np.polynomial.legendre.leggauss(3))


class FluidDrag:
    """Drag of slender links in a fluid, strip by strip: each feels the speed across its link.

    The links move in one plane.  ``lever[i, g, k]`` is how fast strip g of link i moves across
    its link when joint k turns by 1 rad/s, and at once how far its force reaches about joint k.
    """

    def __init__(self, robot: DrawnRobot, p: Parameters) -> None:
        self.ratio, self.length, self.density = robot.ratio, robot.length, p["fluid"]
        self.strips = self.length[:, None] * (0.5 + _AT)
        self.before = np.tri(robot.n, k=-1)  # joint k before link i
        self.moved = np.tri(robot.n)

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque at every joint [N m]."""
        turned = np.cumsum(now.q, axis=-1)
        along = np.cos(turned[..., :, None] - turned[..., None, :]) * self.length * self.before
        base = np.cumsum(along[..., ::-1], axis=-1)[..., ::-1]
        lever = (base[..., :, None, :] + self.strips[:, :, None]) * self.moved[:, None, :]
        speed = np.einsum("...igk,...k->...ig", lever, now.dq)
        force = (self.density * self.length)[..., None] * _WEIGHT * speed * np.abs(speed)
        return np.einsum("...igk,...ig->...k", lever, force) / self.ratio


class Hose:
    """Hose that pulls where it was bent to, and creeps: a spring in series with a damper."""

    def __init__(self, p: Parameters, h: float) -> None:
        self.stiffness, self.follow = p["hose"], 1 - np.exp(-h / p["hose_time"])
        self.crept: np.ndarray | None = None

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque [N m]: none after a long rest."""
        if self.crept is None:
            self.crept = now.q
        self.crept = self.crept + self.follow * (now.q - self.crept)
        return self.stiffness * (now.q - self.crept)


class NeighbourSpring:
    """Spring whose stiffness follows the joint before: ``k (q_(k-1) - pose) (q_k - pose)``.

    It comes from the potential ``k (q_(k-1) - pose) (q_k - pose)^2 / 2``, so the joint before
    feels it as well and no energy is made.
    """

    def __init__(self, robot: DrawnRobot, p: Parameters) -> None:
        self.pose, self.ratio, self.stiffness = robot.pose, robot.ratio, p["neighbour"]

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque at both joints [N m]."""
        off = now.q - self.pose
        torque = np.zeros_like(off)
        joint_side = (self.stiffness * self.ratio)[..., 1:]
        torque[..., 1:] = joint_side * off[..., :-1] * off[..., 1:]
        torque[..., :-1] += joint_side * off[..., 1:] ** 2 / 2
        return torque / self.ratio


class Detent:
    """Magnets of two neighbours that hold each other at equal steps of their difference."""

    def __init__(self, robot: DrawnRobot, p: Parameters) -> None:
        self.ratio, self.level, self.teeth = robot.ratio, p["detent"], p["detent_teeth"]

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque at both joints [N m]: equal and opposite on the joint side."""
        between = (self.teeth[..., 1:] * np.diff(now.q, axis=-1))
        pull = (self.level * self.ratio)[..., 1:] * np.sin(between)
        torque = np.zeros_like(now.q)
        torque[..., 1:] = pull
        torque[..., :-1] -= pull
        return torque / self.ratio


class Imbalance:
    """Tool that turns out of balance and runs up: the force grows with the square of its rate."""

    UP_TO = 3.0  # times its first rate, at the end

    def __init__(self, p: Parameters, duration: np.ndarray) -> None:
        self.p, self.duration = p, duration

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque [N m]; ``imbalance`` is its amplitude at the first rate."""
        growth = (self.UP_TO - 1) / self.duration
        rate = 1 + growth * now.t
        turns = self.p["imbalance_hz"] * (now.t + growth * now.t**2 / 2)
        return self.p["imbalance"] * rate**2 * np.sin(2 * np.pi * turns + self.p["phase"])
