"""The sampled control loop around the engine; all lanes of a world step together."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.blind.engine.controller import SampledController, SampledEncoder
from clie_blocks.analysis.blind.engine.drive import Disturbances, Drive, LaneRandom
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.robot import NEUTRAL, DrawnRobot
from clie_blocks.analysis.blind.engine.world import build_model

if TYPE_CHECKING:
    import mujoco

SPEED_LIMIT = 100.0  # rad/s, beyond which a copy has diverged
DIVERGED = 1e3  # rad: the position that is reported for such a copy


def run(robot: DrawnRobot, lanes: Sequence[dict[str, np.ndarray]],
        experiments: Sequence[Experiment], noises: Sequence[np.ndarray],
        seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Run experiments on copies of a robot, in parallel.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    lanes : list of dict
        True parameters of each copy.
    experiments : list of Experiment
        Experiment of each copy.
    noises : list of ndarray, shape (N, n)
        Sensor noise of each copy [rad].
    seed : int
        Of what is random in the drives; the same on copies that run the same experiment.

    Returns
    -------
    list of (q, u)
        Measured position [rad] and command [N m] of each copy, shape (N, n); the position of a
        copy whose loop is unstable is `DIVERGED`.

    """
    import mujoco

    model = build_model(robot, lanes)
    data = mujoco.MjData(model)
    p = {key: np.array([lane[key] for lane in lanes]) for key in NEUTRAL}
    plant = _Plant(model, data, robot, p, len(lanes))
    plant.start(np.array([experiment.start for experiment in experiments]))
    count = max(len(experiment.q_d) for experiment in experiments)
    q_d = _stack([experiment.q_d for experiment in experiments], count)
    pe = _stack([experiment.pe for experiment in experiments], count)
    noise = _stack(noises, count)
    duration = np.array([len(one.q_d) for one in experiments])[:, None] * robot.period
    encoder, controller = SampledEncoder(robot, p), SampledController(robot, p)
    drive = Drive(robot, p, LaneRandom((seed, 1), experiments, robot.n))
    plant.oppose_with(Disturbances(robot, p, duration, LaneRandom((seed, 2), experiments, robot.n),
                                   plant.h))
    measured, commands = np.empty(q_d.shape), np.empty(q_d.shape)
    for i in range(count):
        t = i * robot.period
        measured[i] = encoder(plant.q(), noise[i])
        commands[i] = controller(q_d[i], measured[i], pe[i])
        plant.move(t, drive(t, commands[i]))
    measured[:, plant.diverged] = DIVERGED
    return [(measured[:len(one.q_d), j], commands[:len(one.q_d), j])
            for j, one in enumerate(experiments)]


def _stack(parts: Sequence[np.ndarray], count: int) -> np.ndarray:
    """Stack of shape (N, lanes, n); shorter ones hold their last row."""
    return np.stack([np.concatenate([part, np.repeat(part[-1:], count - len(part), axis=0)])
                     for part in parts], axis=1)


class _Plant:
    """The engine, seen as arrays of shape (lanes, n)."""

    disturbances: Disturbances
    initial: np.ndarray  # angles at rest [rad]

    def __init__(self, model: "mujoco.MjModel", data: "mujoco.MjData", robot: DrawnRobot,
                 p: dict[str, np.ndarray], lanes: int) -> None:
        import mujoco

        self.engine, self.step, self.model, self.data = mujoco, mujoco.mj_step, model, data
        self.ratio, self.shape = robot.ratio, (lanes, robot.n)
        self.h = model.opt.timestep
        self.substeps = round(robot.period / self.h)
        names = [model.joint(j).name for j in range(model.njnt)]
        order = {name: j for j, name in enumerate(names)}
        pairs = [(lane, k) for lane in range(lanes) for k in range(robot.n)]
        self.motor = np.array([order[f"a{lane}_{k}"] for lane, k in pairs])
        twists = [order.get(f"b{lane}_{k}") for lane, k in pairs]
        self.twisted = np.array([twist is not None for twist in twists])
        self.twist = np.array([twist for twist in twists if twist is not None], int)
        self.delayed = p["late"] > 0
        self.diverged = np.zeros(lanes, bool)

    def start(self, angles: np.ndarray) -> None:
        """Put every copy at rest at its start angle."""
        self.initial = angles
        self.data.qpos[self.motor] = angles.ravel()
        self.data.sensordata[:] = angles[self.delayed]
        for j in range(self.model.nsensor):
            count = int(self.model.sensor_history[j, 0])
            self.engine.mj_initSensorHistory(
                self.model, self.data, j, -self.h * np.arange(count, 0, -1.0),
                np.full((count, 1), angles[self.delayed][j]), 0.0)

    def oppose_with(self, disturbances: Disturbances) -> None:
        """Set what opposes the motion."""
        self.disturbances = disturbances
        self.data.qfrc_applied[self.motor] = -(self.ratio * disturbances.constant).ravel()

    def q(self) -> np.ndarray:
        """Joint angles behind the gears [rad]."""
        q = self.data.qpos[self.motor]
        if len(self.twist):
            q[self.twisted] += self.data.qpos[self.twist]
        q = q.reshape(self.shape)
        if self.delayed.any():
            q[self.delayed] = self.data.sensordata
        return q

    def move(self, t: float, u: np.ndarray) -> None:
        """Advance by one sample of the controller under held commands [N m]."""
        self.data.ctrl[:] = u.ravel()
        if self.disturbances.varies:
            for s in range(self.substeps):
                self._oppose(t + s * self.h)
                self.step(self.model, self.data)
        else:
            self.step(self.model, self.data, self.substeps)
        if not np.abs(self.data.qvel).max() < SPEED_LIMIT:  # one copy must not spoil the others
            self._hold_diverged()

    def _oppose(self, t: float) -> None:
        data, disturbances = self.data, self.disturbances
        q, dq = (x[self.motor].reshape(self.shape) for x in (data.qpos, data.qvel))
        if disturbances.torques:
            torque = disturbances.torque(t, q, dq)
            data.qfrc_applied[self.motor] = -(self.ratio * torque).ravel()
        if disturbances.rubs:
            load = (data.qfrc_bias - data.qfrc_gravcomp)[self.motor].reshape(self.shape)
            level = disturbances.level(t, q, dq, load)
            self.model.dof_frictionloss[self.motor] = (self.ratio * level).ravel()

    def _hold_diverged(self) -> None:
        """Hold the copies that have diverged at their start."""
        dq = self.data.qvel[self.motor].reshape(self.shape)
        diverged = ~(np.abs(dq) < SPEED_LIMIT).all(axis=1)
        self.data.qvel[self.motor.reshape(self.shape)[diverged]] = 0.0
        self.data.qpos[self.motor.reshape(self.shape)[diverged]] = self.initial[diverged]
        twist = self.twist[np.repeat(diverged, self.shape[1])[self.twisted]]
        self.data.qvel[twist] = self.data.qpos[twist] = 0.0
        self.data.qacc_warmstart[:] = 0.0
        self.data.act[:] = np.nan_to_num(self.data.act, posinf=0.0, neginf=0.0)
        self.diverged |= diverged
