"""Dry friction with a memory: of the way since the last reversal, or of the rest before a move.

Contacts that bend return a torque that opposes the motion; contacts that stick return a level of
dry friction, which the engine holds.  Arrays have shape (lanes, n).
"""

import numpy as np

from clie_blocks.analysis.blind.engine.chance import LaneRandom, RandomSwitch
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import Parameters


class DahlContact:
    """Contact whose force follows ``dF/dx = s |1 - F/F_s|^i``, by P. R. Dahl, 1968.

    The way of one step is divided, because the force may yield within it.
    """

    PARTS = 4

    def __init__(self, p: Parameters, h: float) -> None:
        self.level, self.exponent, self.part = p["dahl"], p["dahl_exponent"], h / self.PARTS
        self.reach, self.share = p["dahl_reach"], np.zeros_like(p["dahl"])

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque that opposes the motion [N m]."""
        way = np.abs(now.dq) * self.part / self.reach
        sign = np.sign(now.dq)
        for _ in range(self.PARTS):
            left = np.maximum(1 - sign * self.share, 0.0)
            self.share = np.clip(self.share + sign * way * left**self.exponent, -1.0, 1.0)
        return self.level * self.share


class SlippingElements:
    """Springs in parallel, each of which slips at its own bend, by W. D. Iwan, 1966."""

    COUNT = 10

    def __init__(self, p: Parameters, h: float) -> None:
        ends = np.arange(1, self.COUNT + 1) / self.COUNT
        self.level, self.h = p["slip"], h
        self.ends = p["slip_reach"][..., None] * ends  # bend at which each slips
        self.bends = np.zeros_like(self.ends)

    def __call__(self, now: Moment) -> np.ndarray:
        """Torque that opposes the motion [N m]; every element slips at the same torque."""
        self.bends = np.clip(self.bends + (self.h * now.dq)[..., None], -self.ends, self.ends)
        return self.level * np.mean(self.bends / self.ends, axis=-1)


class RestingContact:
    """Contact that grows stronger while it rests, and forgets that as it slides."""

    def __init__(self, p: Parameters, h: float) -> None:
        self.p, self.h, self.rest = p, h, np.zeros_like(p["rest_rise"])

    def __call__(self, now: Moment) -> np.ndarray:
        """Level of dry friction [N m]: what a rest has added, at low speed."""
        p, speed = self.p, np.abs(now.dq)
        slow = np.exp(-(speed / p["rest_speed"]) ** 2)
        self.rest = (self.rest + self.h * slow) * np.exp(-speed * self.h / p["rest_slide"])
        return p["rest_rise"] * self.rest / (self.rest + p["rest_half"]) * slow


class DraggingBrake:
    """Brake that drags at times that nobody commands."""

    OFF, ON = 1.5, 0.4  # s, mean times

    def __init__(self, p: Parameters, random: LaneRandom, h: float) -> None:
        self.level, self.drags = p["brake"], RandomSwitch(random, self.OFF, self.ON, h)

    def __call__(self, now: Moment) -> np.ndarray:
        """Level of dry friction [N m]."""
        return self.level * self.drags()
