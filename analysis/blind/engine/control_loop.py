"""The sampled control loop around the engine; all lanes of a world step together."""

import numpy as np

from clie_blocks.analysis.blind.engine.controller import Controller, Encoder
from clie_blocks.analysis.blind.engine.drive import Chance, Disturbances, Drive
from clie_blocks.analysis.blind.engine.robot import NEUTRAL
from clie_blocks.analysis.blind.engine.world import world

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
        Of what is random in the drives; the same on copies that run the same experiment.

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
    encoder, controller = Encoder(robot, p), Controller(robot, p)
    drive = Drive(robot, p, Chance((seed, 1), motions, robot.n))
    plant.disturb(Disturbances(robot, p, duration, Chance((seed, 2), motions, robot.n), plant.h))
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
        self.late = p["late"] > 0
        self.engine = engine

    def start(self, angles):
        """Put every copy at rest at its start angle."""
        self.begin = angles
        self.data.qpos[self.motor] = angles.ravel()
        self.data.sensordata[:] = angles[self.late]
        for j in range(self.model.nsensor):
            count = int(self.model.sensor_history[j, 0])
            self.engine.mj_initSensorHistory(
                self.model, self.data, j, -self.h * np.arange(count, 0, -1.0),
                np.full((count, 1), angles[self.late][j]), 0.0)

    def disturb(self, disturbances):
        """Take note of what opposes the motion."""
        self.disturbances = disturbances
        self.data.qfrc_applied[self.motor] = -(self.ratio * disturbances.constant).ravel()

    def q(self):
        """Joint angles behind the gears."""
        q = self.data.qpos[self.motor]
        if len(self.twist):
            q[self.twisted] += self.data.qpos[self.twist]
        q = q.reshape(self.shape)
        if self.late.any():
            q[self.late] = self.data.sensordata
        return q

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
