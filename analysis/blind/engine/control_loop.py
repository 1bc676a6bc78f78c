"""The sampled control loop around the engine; all lanes of a world step together."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.blind.engine.chance import LaneRandom
from clie_blocks.analysis.blind.engine.controller import (
    SampledController,
    SampledEncoder,
    SecondEncoder,
)
from clie_blocks.analysis.blind.engine.disturbances import Disturbances
from clie_blocks.analysis.blind.engine.drive import Drive
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import NEUTRAL, Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.engine.variable_gear import VariableGear, rigid_motor
from clie_blocks.analysis.blind.engine.world import build_model

if TYPE_CHECKING:
    import mujoco

SPEED_LIMIT = 100.0  # rad/s, beyond which a copy has diverged
DIVERGED = 1e3  # rad: the position that is reported for such a copy


def run(robot: DrawnRobot, lanes: Sequence[Parameters],
        experiments: Sequence[Experiment], noises: Sequence[np.ndarray],
        seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Run experiments on copies of a robot, in parallel: what the controller saw and commanded.

    Parameters and result are those of `run_both`, without the other encoder.
    """
    return [(q, u) for q, u, _ in run_both(robot, lanes, experiments, noises, seed)]


def run_both(robot: DrawnRobot, lanes: Sequence[Parameters],
             experiments: Sequence[Experiment], noises: Sequence[np.ndarray],
             seed: int = 0) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
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
    list of (q, u, other)
        Measured position [rad] and command [N m] of each copy, shape (N, n), and the position
        that an encoder measures on the other side of the gear, in angles of the joint; positions
        of a copy whose loop is unstable are `DIVERGED`.

    """
    import mujoco

    model = build_model(robot, lanes)
    data = mujoco.MjData(model)
    p = {key: np.array([lane[key] for lane in lanes]) for key in NEUTRAL}
    plant = _Plant(model, data, robot, p, len(lanes))
    plant.start(np.array([experiment.start for experiment in experiments]) - p["zero"])
    count = max(len(experiment.q_d) for experiment in experiments)
    q_d = _stack([experiment.q_d for experiment in experiments], count)
    pe = _stack([experiment.pe for experiment in experiments], count)
    noise = _stack(noises, count)
    duration = np.array([len(one.q_d) for one in experiments])[:, None] * robot.period
    chance = [LaneRandom((seed, stream), experiments, robot.n) for stream in (1, 2, 3)]
    encoder = SampledEncoder(robot, p, duration, chance[2])
    controller, drive = SampledController(robot, p), Drive(robot, p, chance[0])
    plant.attach(drive, Disturbances(robot, p, duration, chance[1], plant.h))
    second = SecondEncoder(robot, LaneRandom((seed, 4), experiments, robot.n))
    measured, commands, others = (np.empty(q_d.shape) for _ in range(3))
    for i in range(count):
        t = i * robot.period
        measured[i] = encoder(t, plant.q(), noise[i])
        if robot.two_encoders:
            others[i] = second(plant.other_q())
        commands[i] = controller(q_d[i], measured[i], pe[i])
        plant.move(t, drive(t, commands[i]))
    measured[:, plant.diverged] = others[:, plant.diverged] = DIVERGED
    return [(measured[:len(one.q_d), j], commands[:len(one.q_d), j], others[:len(one.q_d), j])
            for j, one in enumerate(experiments)]


def _stack(parts: Sequence[np.ndarray], count: int) -> np.ndarray:
    """Stack of shape (N, lanes, n); shorter ones hold their last row."""
    return np.stack([np.concatenate([part, np.repeat(part[-1:], count - len(part), axis=0)])
                     for part in parts], axis=1)


class _Plant:
    """The engine, seen as arrays of shape (lanes, n)."""

    drive: Drive
    disturbances: Disturbances
    initial: np.ndarray  # angles at rest of all joints of the engine [rad]

    def __init__(self, model: "mujoco.MjModel", data: "mujoco.MjData", robot: DrawnRobot,
                 p: Parameters, lanes: int) -> None:
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
        self.sees_links = not robot.encoder_on_motor
        self.p, self.of_both = p, robot.two_encoders
        self.lane = np.array([int(name[1:].partition("_")[0]) for name in names])
        self.hanging = np.array([name[0] == "p" for name in names])
        self.delayed = p["late"] > 0
        self.gear = VariableGear(model, robot, p, self.motor)
        self.diverged = np.zeros(lanes, bool)

    def start(self, angles: np.ndarray) -> None:
        """Put every copy at rest at its start angle; a pendulum at its tip hangs down."""
        self.data.qpos[self.motor] = angles.ravel()
        self.data.qpos[self.hanging] = -np.pi / 2 - angles.sum(axis=1)[self.lane[self.hanging]]
        self.initial = self.data.qpos.copy()
        self.data.sensordata[:] = angles[self.delayed]
        for j in range(self.model.nsensor):
            count = int(self.model.sensor_history[j, 0])
            self.engine.mj_initSensorHistory(
                self.model, self.data, j, -self.h * np.arange(count, 0, -1.0),
                np.full((count, 1), angles[self.delayed][j]), 0.0)

    def attach(self, drive: Drive, disturbances: Disturbances) -> None:
        """Set the drives, and what opposes the motion."""
        self.drive, self.disturbances = drive, disturbances
        self.data.qfrc_applied[self.motor] = -(self.ratio * disturbances.constant).ravel()

    def q(self) -> np.ndarray:
        """Joint angles at the encoders [rad], behind the gears or on the motors."""
        q = self._links() if self.sees_links else self._motors()
        if self.delayed.any():
            q[self.delayed] = self.data.sensordata
        return q

    def other_q(self) -> np.ndarray:
        """Joint angles at the other end of the gears [rad]; of motors over the stated ratio."""
        return self._motors() if self.sees_links else self._links()

    def _links(self) -> np.ndarray:
        q = self.data.qpos[self.motor]
        if len(self.twist):
            q[self.twisted] += self.data.qpos[self.twist]
        return q.reshape(self.shape)

    def _motors(self) -> np.ndarray:
        """Angles of the motors over the ratio: with rigid gears those that the links follow."""
        q = self.data.qpos[self.motor].reshape(self.shape)
        return rigid_motor(q, self.p) if self.of_both else q

    def move(self, t: float, u: np.ndarray) -> None:
        """Advance by one sample of the controller under held commands [N m]."""
        self.data.ctrl[:] = u.ravel()
        if self.disturbances.varies or self.drive.turning or self.gear.varies:
            for s in range(self.substeps):
                self._act(t + s * self.h, u)
                self.step(self.model, self.data)
        else:
            self.step(self.model, self.data, self.substeps)
        if not np.abs(self.data.qvel).max() < SPEED_LIMIT:  # one copy must not spoil the others
            self._hold_diverged()

    def _act(self, t: float, u: np.ndarray) -> None:
        """Set all torques as they are at the beginning of a step of the engine."""
        data, disturbances = self.data, self.disturbances
        q, dq = (x[self.motor].reshape(self.shape) for x in (data.qpos, data.qvel))
        now = Moment(t, q, dq, u)
        if self.drive.turning:
            now = now._replace(u=self.drive.torque(now))
            data.ctrl[:] = now.u.ravel()
        offset = self.ratio * disturbances.constant
        turning = self.gear.turn(q, dq, offset) if self.gear.varies else 0.0
        if disturbances.torques or self.gear.varies:
            opposing = self.ratio * disturbances.torque(now) + turning
            data.qfrc_applied[self.motor] = -opposing.ravel()
        if disturbances.rubs:
            load = (data.qfrc_bias - data.qfrc_gravcomp)[self.motor].reshape(self.shape)
            level = disturbances.level(now, load)
            self.model.dof_frictionloss[self.motor] = (self.ratio * level).ravel()

    def _hold_diverged(self) -> None:
        """Hold the copies that have diverged at their start."""
        fast = ~(np.abs(self.data.qvel) < SPEED_LIMIT)
        fast[self.twist] = False  # a light gear may ring; its motor and link tell
        diverged = np.zeros(self.shape[0], bool)
        diverged[self.lane[fast]] = True
        held = diverged[self.lane]
        self.data.qvel[held] = 0.0
        self.data.qpos[held] = self.initial[held]
        self.data.qacc_warmstart[:] = 0.0
        self.data.act[:] = np.nan_to_num(self.data.act, posinf=0.0, neginf=0.0)
        self.diverged |= diverged
