"""The sampled control loop around the engine; all lanes of a world step together.

Each optional part is a small function of its own and is called only where a lane has it.
"""

import numpy as np

from clie_blocks.analysis.blind.robot import NEUTRAL
from clie_blocks.analysis.blind.world import RUBBING, world

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
    encoder, controller = _Encoder(robot, p), _Controller(robot, p)
    drive = _Drive(robot, p, duration, seed)
    plant.disturb(_Disturbances(robot, p, duration, seed, plant.h))
    measured, commands = np.empty(q_d.shape), np.empty(q_d.shape)
    for i in range(count):
        t = i * robot.period
        measured[i] = encoder(plant.q(), noise[i])
        commands[i] = controller(q_d[i], measured[i], pe[i])
        plant.move(t, drive(t, commands[i]))
    measured[:, plant.wild] = NOWHERE
    return [(measured[:len(m.q_d), j], commands[:len(m.q_d), j]) for j, m in enumerate(motions)]


def _stacked(parts, count):
    """Stack of shape (N, lanes, n); shorter ones hold their last row."""
    return np.stack([np.concatenate([part, np.repeat(part[-1:], count - len(part), axis=0)])
                     for part in parts], axis=1)


class _Encoder:
    """What the encoder says: eccentric, noisy, rounded to its own step and to the log's."""

    def __init__(self, robot, p):
        self.shaft, self.phase, self.resolution = robot.shaft, p["phase"], robot.resolution
        self.step = np.maximum(robot.resolution, p["step"])
        self.coarse = bool(np.any(self.step > robot.resolution))
        self.eccentric = p["eccentric"] if p["eccentric"].any() else None

    def __call__(self, q, noise):
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


class _Controller:
    """PD law with the velocity filter G1, at rest before the first sample."""

    def __init__(self, robot, p):
        high, low = (p["corner"] * corner for corner in robot.corners)
        self.b, self.a = filter_coefficients(high, low, robot.period, robot.discretisation)
        self.kp, self.kd, self.step = robot.kp * p["kp_factor"], robot.kd, robot.command_step
        self.integral = robot.period * p["integral"] if p["integral"].any() else None
        self.begin, self.first, self.second, self.sum = None, 0.0, 0.0, 0.0

    def __call__(self, q_d, q, pe):
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

    def __init__(self, robot, p, duration, seed, h):
        self.p, self.ratio, self.fault, self.h = p, robot.ratio, p["fault_share"] * duration, h
        self.rng, self.noise = np.random.default_rng([seed, 2]), 0.0
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
        kick = np.sqrt(2 * rate * self.h) * self.rng.standard_normal(q.shape)
        self.noise = self.noise * (1 - rate * self.h) + kick
        return self.p["random"] * self.noise


class _Plant:
    """The engine, seen as arrays of shape (lanes, n)."""

    def __init__(self, engine, model, data, robot, p, lanes):
        self.step, self.model, self.data = engine.mj_step, model, data
        self.ratio, self.shape = robot.ratio, (lanes, robot.n)
        self.h = model.opt.timestep
        self.substeps = round(robot.period / self.h)
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

    def disturb(self, disturbances):
        """Take note of what opposes the motion."""
        self.disturbances = disturbances
        self.data.qfrc_applied[self.motor] = -(self.ratio * disturbances.constant).ravel()

    def q(self):
        """Joint angles behind the gears."""
        q = self.data.qpos[self.motor]
        if len(self.twist):
            q[self.twisted] += self.data.qpos[self.twist]
        return q.reshape(self.shape)

    def move(self, t, u):
        """Advance by one sample of the controller under held commands."""
        self.data.ctrl[:] = u.ravel()
        if self.disturbances.varies:
            for s in range(self.substeps):
                self._oppose(t + s * self.h)
                self.step(self.model, self.data)
        else:
            self.step(self.model, self.data, self.substeps)
        if not np.abs(self.data.qvel).max() < WILD:  # one copy must not spoil the others
            self._brake()

    def _oppose(self, t):
        data, disturbances = self.data, self.disturbances
        q, dq = (x[self.motor].reshape(self.shape) for x in (data.qpos, data.qvel))
        if disturbances.torques:
            torque = disturbances.torque(t, q, dq)
            data.qfrc_applied[self.motor] = -(self.ratio * torque).ravel()
        if disturbances.rubs:
            load = (data.qfrc_bias - data.qfrc_gravcomp)[self.motor].reshape(self.shape)
            level = disturbances.level(t, q, dq, load)
            self.model.dof_frictionloss[self.motor] = (self.ratio * level).ravel()

    def _brake(self):
        """Hold the copies that have gone wild at their start."""
        dq = self.data.qvel[self.motor].reshape(self.shape)
        lost = ~(np.abs(dq) < WILD).all(axis=1)
        self.data.qvel[self.motor.reshape(self.shape)[lost]] = 0.0
        self.data.qpos[self.motor.reshape(self.shape)[lost]] = self.begin[lost]
        twist = self.twist[np.repeat(lost, self.shape[1])[self.twisted]]
        self.data.qvel[twist] = self.data.qpos[twist] = 0.0
        self.data.qacc_warmstart[:] = 0.0
        self.data.act[:] = np.nan_to_num(self.data.act, posinf=0.0, neginf=0.0)
        self.wild |= lost
