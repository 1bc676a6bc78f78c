"""The sampled control loop around the engine; all lanes of a world step together.

Each optional part is a small function of its own and is called only where a lane has it.
"""

import numpy as np

from clie_blocks.analysis.blind.robot import NEUTRAL
from clie_blocks.analysis.blind.world import STEP, world

WILD = 100.0  # rad/s
NOWHERE = 1e3  # rad: what is said of a copy that went wild


def run(robot, lanes, motions, noises, seed=0):
    """Run experiments on copies of a robot, side by side.

    Parameters
    ----------
    robot : Robot
        As stated.
    lanes : list of dict
        True numbers of each copy.
    motions : list of Motion
        Experiment of each copy.
    noises : list of ndarray, shape (N, n)
        Sensor noise of each copy [rad].
    seed : int
        Of what is random in the drives.

    Returns
    -------
    list of (q, u)
        Measured position and command of each copy, shape (N, n); a copy whose loop is unstable
        is nowhere.

    """
    import mujoco

    model = world(robot, lanes)
    data = mujoco.MjData(model)
    p = {key: np.array([lane[key] for lane in lanes]) for key in NEUTRAL}
    plant = _Plant(mujoco, model, data, robot, p, len(lanes))
    plant.start(np.array([motion.start for motion in motions]))
    count = max(len(motion.q_d) for motion in motions)
    q_d, pe = (_stacked([getattr(m, key) for m in motions], count) for key in ("q_d", "pe"))
    noise = _stacked(noises, count)
    duration = np.array([len(m.q_d) for m in motions])[:, None] * robot.period
    controller = _Controller(robot, p)
    drive = _Drive(robot, p, duration, seed)
    disturb = _Disturbances(robot, p, duration, seed)
    measured, commands = np.empty(q_d.shape), np.empty(q_d.shape)
    for i in range(count):
        t = i * robot.period
        measured[i] = _seen(plant.q(), noise[i], robot, p)
        commands[i] = controller(q_d[i], measured[i], pe[i])
        plant.move(t, drive(t, commands[i]), disturb)
    measured[:, plant.wild] = NOWHERE
    return [(measured[:len(m.q_d), j], commands[:len(m.q_d), j]) for j, m in enumerate(motions)]


def _stacked(parts, count):
    """Stack of shape (N, lanes, n); shorter ones hold their last row."""
    return np.stack([np.concatenate([part, np.repeat(part[-1:], count - len(part), axis=0)])
                     for part in parts], axis=1)


def _seen(q, noise, robot, p):
    """What the encoder says."""
    q = q + p["eccentric"] * np.sin(robot.shaft * q + p["phase"]) + noise
    step = np.maximum(robot.resolution, p["step"])
    return np.round(np.round(q / step) * step / robot.resolution) * robot.resolution


class _Controller:
    """PD law with the velocity filter G1 in Tustin's form, at rest before the first sample."""

    def __init__(self, robot, p):
        self.robot, self.integral = robot, p["integral"]
        high, low = (p["corner"] * corner * robot.period for corner in robot.corners)
        self.past, self.keep_fast = (2 - high) / (2 + high), 2 * high / robot.period / (2 + high)
        self.keep_slow, self.share = (2 - low) / (2 + low), low / (2 + low)
        self.kp, self.last = robot.kp * p["kp_factor"], None
        self.fast = self.slow = self.sum = 0.0

    def __call__(self, q_d, q, pe):
        last = q if self.last is None else self.last
        fast = self.past * self.fast + self.keep_fast * (q - last)
        self.slow = self.keep_slow * self.slow + self.share * (fast + self.fast)
        self.fast, self.last = fast, q
        self.sum = self.sum + self.robot.period * self.integral * (q_d - q)
        u = self.kp * (q_d - q) - self.robot.kd * self.slow + pe + self.sum
        return np.round(u / self.robot.command_step) * self.robot.command_step


class _Drive:
    """What becomes of a command before it reaches the motor."""

    BURST = 0.03  # s

    def __init__(self, robot, p, duration, seed):
        self.robot, self.p = robot, p
        self.rng, self.kept, self.until = np.random.default_rng([seed, 1]), 0.0, -1.0
        self.heat, self.duration = 0.0, duration
        self.parts = [part for key, part in (
            ("lost", self._lost), ("dead", self._dead), ("heating", self._heated),
            ("sag", self._sagged)) if np.any(p[key] > 0)]

    def __call__(self, t, u):
        for part in self.parts:
            u = part(t, u)
        return u

    def _lost(self, t, u):
        fresh = self.rng.random(u.shape) < self.p["lost"] * self.robot.period / self.BURST
        hit = fresh & (t >= self.until)
        self.until = np.where(hit, t + self.BURST * self.rng.exponential(1.0, u.shape), self.until)
        self.kept = np.where(t < self.until, self.kept, u)
        return self.kept

    def _dead(self, t, u):
        return u - np.clip(u, -self.p["dead"], self.p["dead"])

    def _heated(self, t, u):
        self.heat = self.heat + self.robot.period / self.duration * (u / self.robot.kp) ** 2
        return u * (1 - self.p["heating"] * self.heat / (self.heat + 0.002))

    def _sagged(self, t, u):
        return u * (1 - self.p["sag"] * np.sum(np.abs(u) / self.robot.kp, axis=-1, keepdims=True))


class _Disturbances:
    """Torques [N m, motor side] that oppose the motion and the level of dry friction."""

    def __init__(self, robot, p, duration, seed):
        self.p, self.ratio, self.fault = p, robot.ratio, p["fault_share"] * duration
        self.rng, self.noise, self.bristle = np.random.default_rng([seed, 2]), 0.0, 0.0
        self.torques = [part for key, part in (
            ("bias", self._bias), ("offset", self._offset), ("ripple", self._ripple),
            ("tone", self._tone), ("fault_torque", self._step), ("fault_drag", self._step_drag),
            ("warm_drag", self._warm), ("wavy_drag", self._wavy), ("wandering", self._wander),
            ("stop_stiffness", self._stop), ("random", self._random), ("bristle", self._bristles))
            if np.any(p[key])]
        keys = ("level", "slope", "wavy_level", "warm_level", "fault_level")
        self.rubs = any(np.any(p[key] > 0) for key in keys)

    def torque(self, t, q, dq):
        return sum((part(t, q, dq) for part in self.torques), np.zeros_like(q))

    def level(self, t, q, dq, load):
        """Dry friction [N m, motor side]: Stribeck, load, pose, warming, fault."""
        p = self.p
        level = p["level"] * (1 + (p["static"] - 1) * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + p["slope"] * np.abs(load) / self.ratio
        level = level + p["wavy_level"] * np.maximum(np.sin(p["waves"] * q + p["phase"]), 0.0)
        level = level + p["warm_level"] * (1 - np.exp(-t / p["warm_time"]))
        return level + p["fault_level"] * (t > self.fault)

    def _offset(self, t, q, dq):
        return self.p["offset"]

    def _bias(self, t, q, dq):
        return self.p["bias"]

    def _ripple(self, t, q, dq):
        return self.p["ripple"] * np.sin(self.p["order"] * q + self.p["phase"])

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
        kick = np.sqrt(2 * rate * STEP) * self.rng.standard_normal(q.shape)
        self.noise = self.noise * (1 - rate * STEP) + kick
        return self.p["random"] * self.noise

    def _bristles(self, t, q, dq):
        """Bristles that yield over `bristle_range`: their deflection follows the travel."""
        way = np.exp(-np.abs(dq) * STEP / self.p["bristle_range"])
        self.bristle = np.sign(dq) + (self.bristle - np.sign(dq)) * way
        return self.p["bristle"] * self.bristle


class _Plant:
    """The engine, seen as arrays of shape (lanes, n)."""

    def __init__(self, engine, model, data, robot, p, lanes):
        self.step, self.model, self.data = engine.mj_step, model, data
        self.ratio, self.shape = robot.ratio, (lanes, robot.n)
        self.substeps = round(robot.period / STEP)
        names = [model.joint(j).name for j in range(model.njnt)]
        order = {name: j for j, name in enumerate(names)}
        pairs = [(lane, k) for lane in range(lanes) for k in range(robot.n)]
        self.motor = np.array([order[f"a{lane}_{k}"] for lane, k in pairs])
        twists = [order.get(f"b{lane}_{k}") for lane, k in pairs]
        self.twisted = np.array([twist is not None for twist in twists])
        self.wild = np.zeros(lanes, bool)
        self.twist = np.array([twist for twist in twists if twist is not None], int)

    def start(self, angles):
        """Put every copy at rest at its start angle."""
        self.begin = angles
        self.data.qpos[self.motor] = angles.ravel()

    def q(self):
        """Joint angles behind the gears."""
        q = self.data.qpos[self.motor]
        q[self.twisted] += self.data.qpos[self.twist]
        return q.reshape(self.shape)

    def move(self, t, u, disturbances):
        """Advance by one sample of the controller under held commands."""
        data = self.data
        data.ctrl[:] = u.ravel()
        for s in range(self.substeps):
            now = t + s * STEP
            q, dq = (x[self.motor].reshape(self.shape) for x in (data.qpos, data.qvel))
            torque = disturbances.torque(now, q, dq)
            data.qfrc_applied[self.motor] = -(self.ratio * torque).ravel()
            if disturbances.rubs:
                load = (data.qfrc_bias - data.qfrc_gravcomp)[self.motor].reshape(self.shape)
                level = disturbances.level(now, q, dq, load)
                self.model.dof_frictionloss[self.motor] = (self.ratio * level).ravel()
            self.step(self.model, data)
        if not np.abs(data.qvel).max() < WILD:  # one copy must not spoil the others
            self._brake()

    def _brake(self):
        """Hold the copies that have gone wild at their start."""
        dq = self.data.qvel[self.motor].reshape(self.shape)
        lost = ~(np.abs(dq) < WILD).all(axis=1)
        self.data.qvel[self.motor.reshape(self.shape)[lost]] = 0.0
        self.data.qpos[self.motor.reshape(self.shape)[lost]] = self.begin[lost]
        twist = self.twist[np.repeat(lost, self.shape[1])[self.twisted]]
        self.data.qvel[twist] = self.data.qpos[twist] = 0.0
        self.data.qacc_warmstart[:] = 0.0
        self.wild |= lost
