"""What a drive does to a command, and what opposes a joint, where the engine has no such part.

Each part is a small function of its own and is called only where a lane has it.  Arrays have
shape (lanes, n).
"""

from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.engine.world import DRY_FRICTION


class LaneRandom:
    """Random numbers for all lanes: the same on all copies that run the same experiment.

    Parameters
    ----------
    seed : sequence of int
        Of all of them.
    experiments : sequence
        Experiment of each lane.
    n : int
        Number of joints.

    """

    def __init__(self, seed: Sequence[int], experiments: Sequence[object], n: int) -> None:
        order = list(dict.fromkeys(map(id, experiments)))
        self.lane = [order.index(id(experiment)) for experiment in experiments]
        self.n = n
        self.sources = [np.random.default_rng([*seed, k]) for k in range(len(order))]

    def __call__(self, kind: str) -> np.ndarray:
        """Draw of a kind, a method of the generator, shape (lanes, n)."""
        return np.stack([getattr(source, kind)(self.n) for source in self.sources])[self.lane]


class Drive:
    """What becomes of a command before it reaches the motor.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.
    random : LaneRandom
        Source of chance.

    """

    BURST = 0.03  # s, mean length of a loss

    def __init__(self, robot: DrawnRobot, p: dict[str, np.ndarray], random: LaneRandom) -> None:
        self.robot, self.p, self.random = robot, p, random
        self.kept: np.ndarray | float = 0.0
        self.until: np.ndarray | float = -1.0
        parts = ("lost", self._lose_packets), ("dead", self._dead_zone), ("sag", self._sag_supply)
        self.parts = [part for key, part in parts if np.any(p[key] > 0)]

    def __call__(self, t: float, u: np.ndarray) -> np.ndarray:
        """Command that reaches the motor [N m]."""
        for part in self.parts:
            u = part(t, u)
        return u

    def _lose_packets(self, t: float, u: np.ndarray) -> np.ndarray:
        fresh = self.random("random") < self.p["lost"] * self.robot.period / self.BURST
        hit = fresh & (t >= self.until)
        end = t + self.BURST * self.random("standard_exponential")
        self.until = np.where(hit, end, self.until)
        self.kept = np.where(t < self.until, self.kept, u)
        return self.kept

    def _dead_zone(self, t: float, u: np.ndarray) -> np.ndarray:
        return u - np.clip(u, -self.p["dead"], self.p["dead"])

    def _sag_supply(self, t: float, u: np.ndarray) -> np.ndarray:
        return u * (1 - self.p["sag"] * np.sum(np.abs(u) / self.robot.kp, axis=-1, keepdims=True))


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

    def __init__(self, robot: DrawnRobot, p: dict[str, np.ndarray], duration: np.ndarray,
                 random: LaneRandom, h: float) -> None:
        self.p, self.ratio, self.fault, self.h = p, robot.ratio, p["fault_share"] * duration, h
        self.random = random
        self.noise: np.ndarray | float = 0.0
        self.constant = p["offset"] + p["bias"]
        parts: tuple[tuple[str, Callable[[float, np.ndarray, np.ndarray], np.ndarray]], ...] = (
            ("tone", self._tone), ("fault_torque", self._step), ("fault_drag", self._step_drag),
            ("warm_drag", self._warm_up), ("wavy_drag", self._wavy_drag),
            ("wandering", self._wander), ("stop_stiffness", self._stop),
            ("random", self._random_torque))
        self.torques = [part for key, part in parts if np.any(p[key])]
        self.rubs = any(np.any(p[key] > 0) for key in DRY_FRICTION)

    @property
    def varies(self) -> bool:
        """Whether there is more than a constant torque."""
        return bool(self.torques) or self.rubs

    def torque(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        """Sum of all but dry friction [N m, motor side]."""
        return sum((part(t, q, dq) for part in self.torques), self.constant)

    def level(self, t: float, q: np.ndarray, dq: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Dry friction [N m, motor side]: Stribeck, load, pose, warming, fault."""
        p = self.p
        level = p["level"] * (1 + (p["static"] - 1) * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + p["slope"] * np.abs(load) / self.ratio
        level = level + p["wavy_level"] * np.maximum(np.sin(p["waves"] * q + p["phase"]), 0.0)
        level = level + p["warm_level"] * (1 - np.exp(-t / p["warm_time"]))
        return level + p["fault_level"] * (t > self.fault)

    def _tone(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["tone"] * np.sin(2 * np.pi * self.p["tone_hz"] * t + self.p["phase"])

    def _step(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["fault_torque"] * (t > self.fault)

    def _step_drag(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["fault_drag"] * (t > self.fault) * dq

    def _warm_up(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["warm_drag"] * (1 - np.exp(-t / self.p["warm_time"])) * dq

    def _wavy_drag(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["wavy_drag"] * np.sin(self.p["waves"] * q + self.p["phase"]) * dq

    def _wander(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["wandering"] * np.sin(1.9 * t + 2 * np.sin(0.7 * t)) * (q - self.p["rest"])

    def _stop(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        return self.p["stop_stiffness"] * np.maximum(q - self.p["stop"], 0.0)

    def _random_torque(self, t: float, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        rate = 2 * np.pi * 1.0  # corner of 1 Hz
        kick = np.sqrt(2 * rate * self.h) * self.random("standard_normal")
        self.noise = self.noise * (1 - rate * self.h) + kick
        return self.p["random"] * self.noise
