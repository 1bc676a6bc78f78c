"""What a drive does to a command, and what opposes a joint, where the engine has no such part.

Each part is a small function of its own and is called only where a lane has it.
"""

import numpy as np

from clie_blocks.analysis.blind.engine.world import RUBBING


class Chance:
    """Random numbers for all lanes: the same on all copies that run the same experiment.

    Parameters
    ----------
    seed : sequence of int
        Of all of them.
    motions : list
        Experiment of each lane.
    n : int
        Joints.

    """

    def __init__(self, seed, motions, n):
        order = list(dict.fromkeys(map(id, motions)))
        self.lane, self.n = [order.index(id(motion)) for motion in motions], n
        self.sources = [np.random.default_rng([*seed, k]) for k in range(len(order))]

    def __call__(self, kind):
        """Draw of a kind, a method of the generator, shape (lanes, n)."""
        return np.stack([getattr(source, kind)(self.n) for source in self.sources])[self.lane]


class Drive:
    """What becomes of a command before it reaches the motor."""

    BURST = 0.03  # s

    def __init__(self, robot, p, chance):
        self.robot, self.p = robot, p
        self.chance, self.kept, self.until = chance, 0.0, -1.0
        parts = ("lost", self._lost), ("dead", self._dead), ("sag", self._sagged)
        self.parts = [part for key, part in parts if np.any(p[key] > 0)]

    def __call__(self, t, u):
        """Command that reaches the motor [N m]."""
        for part in self.parts:
            u = part(t, u)
        return u

    def _lost(self, t, u):
        fresh = self.chance("random") < self.p["lost"] * self.robot.period / self.BURST
        hit = fresh & (t >= self.until)
        long = t + self.BURST * self.chance("standard_exponential")
        self.until = np.where(hit, long, self.until)
        self.kept = np.where(t < self.until, self.kept, u)
        return self.kept

    def _dead(self, t, u):
        return u - np.clip(u, -self.p["dead"], self.p["dead"])

    def _sagged(self, t, u):
        return u * (1 - self.p["sag"] * np.sum(np.abs(u) / self.robot.kp, axis=-1, keepdims=True))


class Disturbances:
    """Torques [N m, motor side] that oppose the motion and the level of dry friction."""

    def __init__(self, robot, p, duration, chance, h):
        self.p, self.ratio, self.fault, self.h = p, robot.ratio, p["fault_share"] * duration, h
        self.chance, self.noise = chance, 0.0
        self.constant = p["offset"] + p["bias"]
        self.torques = [part for key, part in (
            ("tone", self._tone), ("fault_torque", self._step), ("fault_drag", self._step_drag),
            ("warm_drag", self._warm), ("wavy_drag", self._wavy), ("wandering", self._wander),
            ("stop_stiffness", self._stop), ("random", self._random)) if np.any(p[key])]
        self.rubs = any(np.any(p[key] > 0) for key in RUBBING)

    @property
    def varies(self):
        """Whether there is more than a constant torque."""
        return bool(self.torques) or self.rubs

    def torque(self, t, q, dq):
        """Sum of all but dry friction [N m, motor side]."""
        return sum((part(t, q, dq) for part in self.torques), self.constant)

    def level(self, t, q, dq, load):
        """Dry friction [N m, motor side]: Stribeck, load, pose, warming, fault."""
        p = self.p
        level = p["level"] * (1 + (p["static"] - 1) * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + p["slope"] * np.abs(load) / self.ratio
        level = level + p["wavy_level"] * np.maximum(np.sin(p["waves"] * q + p["phase"]), 0.0)
        level = level + p["warm_level"] * (1 - np.exp(-t / p["warm_time"]))
        return level + p["fault_level"] * (t > self.fault)

    def _tone(self, t, q, dq):
        return self.p["tone"] * np.sin(2 * np.pi * self.p["tone_hz"] * t + self.p["phase"])

    def _step(self, t, q, dq):
        return self.p["fault_torque"] * (t > self.fault)

    def _step_drag(self, t, q, dq):
        return self.p["fault_drag"] * (t > self.fault) * dq

    def _warm(self, t, q, dq):
        return self.p["warm_drag"] * (1 - np.exp(-t / self.p["warm_time"])) * dq

    def _wavy(self, t, q, dq):
        return self.p["wavy_drag"] * np.sin(self.p["waves"] * q + self.p["phase"]) * dq

    def _wander(self, t, q, dq):
        return self.p["wandering"] * np.sin(1.9 * t + 2 * np.sin(0.7 * t)) * (q - self.p["rest"])

    def _stop(self, t, q, dq):
        return self.p["stop_stiffness"] * np.maximum(q - self.p["stop"], 0.0)

    def _random(self, t, q, dq):
        rate = 2 * np.pi * 1.0  # corner of 1 Hz
        kick = np.sqrt(2 * rate * self.h) * self.chance("standard_normal")
        self.noise = self.noise * (1 - rate * self.h) + kick
        return self.p["random"] * self.noise
