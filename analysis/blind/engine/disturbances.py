"""What opposes a joint, where the engine has no such part: torques and levels of dry friction.

Each part is a small function or object of its own and is called only where a lane has it.
Arrays have shape (lanes, n), torques [N m] are of the motor side.
"""

from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.engine.chance import LaneRandom
from clie_blocks.analysis.blind.engine.loads import (
    Detent,
    FluidDrag,
    Hose,
    Imbalance,
    NeighbourSpring,
)
from clie_blocks.analysis.blind.engine.memory_friction import (
    DahlContact,
    DraggingBrake,
    RestingContact,
    SlippingElements,
)
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import DRY_FRICTION, Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot

Part = Callable[[Moment], np.ndarray]


class Disturbances:
    """Torques that oppose the motion and the level of dry friction, motor side [N m].

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
    h : float
        Step of the engine [s].

    """

    def __init__(self, robot: DrawnRobot, p: Parameters, duration: np.ndarray,
                 random: LaneRandom, h: float) -> None:
        self.p, self.ratio, self.fault, self.h = p, robot.ratio, p["fault_share"] * duration, h
        self.random = random
        self.noise: np.ndarray | float = 0.0
        self.constant = p["offset"] + p["bias"]
        torques: dict[str, Callable[[], Part]] = {
            "tone": lambda: self._tone, "fault_torque": lambda: self._step,
            "fault_drag": lambda: self._step_drag, "warm_drag": lambda: self._warm_up,
            "wavy_drag": lambda: self._wavy_drag, "wandering": lambda: self._wander,
            "stop_stiffness": lambda: self._stop, "random": lambda: self._random_torque,
            "mesh": lambda: self._mesh, "dahl": lambda: DahlContact(p, h),
            "slip": lambda: SlippingElements(p, h), "fluid": lambda: FluidDrag(robot, p),
            "hose": lambda: Hose(p, h), "neighbour": lambda: NeighbourSpring(robot, p),
            "detent": lambda: Detent(robot, p), "imbalance": lambda: Imbalance(p, duration)}
        levels: dict[str, Callable[[], Part]] = {
            "uneven_level": lambda: self._uneven_level, "driven_loss": lambda: self._gear_loss,
            "rest_rise": lambda: RestingContact(p, h),
            "brake": lambda: DraggingBrake(p, random, h)}
        self.torques = [make() for key, make in torques.items() if np.any(p[key])]
        self.levels = [make() for key, make in levels.items() if np.any(p[key])]
        self.rubs = any(np.any(p[key] > 0) for key in DRY_FRICTION)

    @property
    def varies(self) -> bool:
        """Whether there is more than a constant torque."""
        return bool(self.torques) or self.rubs

    def torque(self, now: Moment) -> np.ndarray:
        """Sum of all but dry friction [N m, motor side]."""
        return sum((part(now) for part in self.torques), self.constant)

    def level(self, now: Moment, load: np.ndarray) -> np.ndarray:
        """Dry friction [N m, motor side]: Stribeck, load, pose, warming, fault, and its parts."""
        p, (t, q, dq, _) = self.p, now
        level = p["level"] * (1 + (p["static"] - 1) * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + p["slope"] * np.abs(load) / self.ratio
        level = level + p["wavy_level"] * np.maximum(np.sin(p["waves"] * q + p["phase"]), 0.0)
        level = level + p["warm_level"] * (1 - np.exp(-t / p["warm_time"]))
        level = level + p["fault_level"] * (t > self.fault)
        return sum((part(now) for part in self.levels), level)

    def _tone(self, now: Moment) -> np.ndarray:
        return self.p["tone"] * np.sin(2 * np.pi * self.p["tone_hz"] * now.t + self.p["phase"])

    def _step(self, now: Moment) -> np.ndarray:
        return self.p["fault_torque"] * (now.t > self.fault)

    def _step_drag(self, now: Moment) -> np.ndarray:
        return self.p["fault_drag"] * (now.t > self.fault) * now.dq

    def _warm_up(self, now: Moment) -> np.ndarray:
        return self.p["warm_drag"] * (1 - np.exp(-now.t / self.p["warm_time"])) * now.dq

    def _wavy_drag(self, now: Moment) -> np.ndarray:
        return self.p["wavy_drag"] * np.sin(self.p["waves"] * now.q + self.p["phase"]) * now.dq

    def _wander(self, now: Moment) -> np.ndarray:
        wander = np.sin(1.9 * now.t + 2 * np.sin(0.7 * now.t))
        return self.p["wandering"] * wander * (now.q - self.p["rest"])

    def _stop(self, now: Moment) -> np.ndarray:
        return self.p["stop_stiffness"] * np.maximum(now.q - self.p["stop"], 0.0)

    def _random_torque(self, now: Moment) -> np.ndarray:
        rate = 2 * np.pi * 1.0  # corner of 1 Hz
        kick = np.sqrt(2 * rate * self.h) * self.random("standard_normal")
        self.noise = self.noise * (1 - rate * self.h) + kick
        return self.p["random"] * self.noise

    def _mesh(self, now: Moment) -> np.ndarray:
        """Teeth that pass: a ripple of their own and one that grows with what they carry."""
        p = self.p
        return (p["mesh"] + p["mesh_depth"] * np.abs(now.u)) * np.sin(
            p["teeth"] * now.q + p["phase"])

    def _uneven_level(self, now: Moment) -> np.ndarray:
        p = self.p
        return p["uneven_level"] * (1 + p["uneven"] * np.cos(p["waves"] * now.q + p["phase"]))

    def _gear_loss(self, now: Moment) -> np.ndarray:
        """Loss of a gear, another one where the load drives the motor."""
        drives = now.u * now.dq > 0
        return np.where(drives, self.p["driving_loss"], self.p["driven_loss"]) * np.abs(now.u)
