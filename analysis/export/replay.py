"""The round trip: the stated law runs a MuJoCo model in the experiment of a log."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.export.correction import check_joint_names
from clie_blocks.analysis.export.mujoco_engine import load
from clie_blocks.analysis.export.mujoco_target import DRIVEN
from clie_blocks.analysis.export.replay_moments import SetIn, seek_moments
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise
from clie_blocks.analysis.gap.report.joint_side import logged_command
from clie_blocks.analysis.gap.report.mjcf import turn
from clie_blocks.errors import ClieError, DivergedError, RecordError
from clie_blocks.robot_loop.block import ramp_memory
from clie_blocks.robot_loop.dynamics import formed_velocity
from clie_blocks.robot_loop.sampled_law import TORQUE, VELOCITY
from clie_blocks.user_files import run_file

if TYPE_CHECKING:
    import mujoco

FAR = 100.0  # times the largest motion of a log: a simulation as far off has diverged


@dataclasses.dataclass(frozen=True)
class JointGap:
    """RMS prediction errors of one joint over all logs.

    Parameters
    ----------
    joint, unit : str
        Its name, and the unit of the errors.
    nominal, corrected : float
        Of the two models, which run without noise.
    floor : float
        What the noise of the encoder leaves of a right model: the noise itself, and the motion
        that it makes in the loop of the corrected model.

    """

    joint: str
    unit: str
    nominal: float
    corrected: float
    floor: float

    @property
    def closed(self) -> float:
        """Share of the gap above the floor that the correction removes [%]."""
        above = self.nominal - self.floor
        return 100.0 * (self.nominal - self.corrected) / above if above > 0.0 else 0.0


@dataclasses.dataclass(frozen=True)
class Replay:
    """What a replay found.

    Parameters
    ----------
    gaps : list of JointGap
        One per joint.
    set_in : list of SetIn
        Moments of faults, sought in the logs that are replayed.

    """

    gaps: list[JointGap]
    set_in: list[SetIn]


class SimulatedModel:
    """A MuJoCo model of the robot of a problem, with the module beside it if there is one.

    Parameters
    ----------
    path : path-like
        The MJCF; ``corrected_joints.json`` beside it says how its joints are driven.
    problem : Problem
        Robot, logs and law.

    Raises
    ------
    ClieError
        If the model lacks a joint of the logs, drives none of them, or its step is no fraction of
        the period of the controller.

    """

    def __init__(self, path: str | PathLike[str], problem: Problem) -> None:
        file = Path(path)
        try:
            text = file.read_text()
        except (OSError, UnicodeDecodeError) as error:
            raise RecordError(f"{file} cannot be read ({error}); give an MJCF, such as "
                              "NAME.corrected.xml of clie export") from None
        self.problem, self.name = problem, file.name
        self.model = load(text, file.name, file.parent)
        beside = file.with_name(DRIVEN)
        told = json.loads(beside.read_text()) if beside.is_file() else {"joints": []}
        self.rows = {row["name"]: row for row in told["joints"]} or {
            name: {"joint": name, "motor": name, "control_per_command": 1.0}
            for name in problem.joints}
        self.joints = [self.rows.get(name, {"joint": name})["joint"] for name in problem.joints]
        known = [self.model.joint(k).name for k in range(self.model.njnt)]
        check_joint_names(tuple(self.joints), tuple(known), file.name)
        is_corrected = told.get("model") == file.name
        self.blocks = (run_file(file.with_name(told["module"]), "module of the corrected joints")
                       ["CorrectedJoints"](self.model)
                       if is_corrected and told["module"] else None)
        self.seen = [self._seen(name, is_corrected) for name in problem.joints]
        self.actuators = [self._actuator(name) for name in self.joints]
        self.ticks = round(problem.period / self.model.opt.timestep)
        if abs(self.ticks * self.model.opt.timestep / problem.period - 1.0) > 1e-3:
            raise ClieError(f"{file.name} steps by {self.model.opt.timestep:g} s, and the "
                            f"controller of the logs runs every {problem.period:g} s: set option "
                            "timestep to that, or to a fraction of it")

    def _seen(self, name: str, is_corrected: bool) -> str:
        """Joint that the encoder sees: that of the motor where it sits there."""
        row = self.rows.get(name, {"joint": name, "motor": name})
        return str(row["motor" if is_corrected and self.problem.encoder_on_motor else "joint"])

    def _actuator(self, joint: str) -> int:
        """Number of the actuator of a joint, or of the motor in front of its gear."""
        import mujoco

        own = {joint, f"{joint}_motor"}
        found = [k for k in range(self.model.nu)
                 if self.model.actuator_trntype[k] == mujoco.mjtTrn.mjTRN_JOINT
                 and self.model.joint(int(self.model.actuator_trnid[k, 0])).name in own]
        if len(found) != 1:
            raise ClieError(f"{self.name}: {len(found)} actuators drive {joint}, and the law of "
                            "the logs needs one, whose control is its command: a <motor>")
        return found[0]

    @property
    def events(self) -> list[tuple[str, str]]:
        """Joint and parameter of what sets in at some moment, which a run may set."""
        return [] if self.blocks is None else [
            (name, parameter) for name in self.problem.joints
            for parameter in self.rows[name].get("events", [])]

    def run(self, log: Log, noise: np.ndarray | None = None,
            moments: Sequence[float] = ()) -> np.ndarray:
        """Positions under the law of the problem in the experiment of a log, shape (N, n).

        The law sees them with some noise of the sensor (N, n) [rad], by default with none: what
        it sees first is the first position of the log.  Each of `events` sets in at its moment
        [s]; without moments, all are there from the start.
        """
        import mujoco

        for (joint, parameter), moment in zip(self.events, moments or [0.0] * len(self.events),
                                              strict=True):
            self.blocks.set(joint, parameter, moment)  # type: ignore[union-attr]
        data, shift = mujoco.MjData(self.model), turn(self.problem)
        seen = np.zeros_like(log.q) if noise is None else noise
        self._place(data, log.start - seen[0] + shift, np.broadcast_to(log.speed, log.start.shape))
        if self.blocks is not None:
            self.blocks.reset()
        command, factor = law_in_steps(self.problem, log), logged_command(self.problem)[0]
        positions, reach = np.empty_like(log.q), FAR * max(float(np.ptp(log.q)), 1e-6)
        for i in range(len(log)):
            positions[i] = self._measured(data) - shift
            if not np.all(np.abs(positions[i] - log.start) < reach):
                raise DivergedError(
                    f"{self.name} diverges in {log.name} after {i * self.problem.period:.3g} s "
                    "under the law of the robot file: check gains and units, or the time step")
            self._advance(data, command(i, positions[i] + seen[i]) / factor)
        return positions

    def _place(self, data: mujoco.MjData, q: np.ndarray, dq: np.ndarray) -> None:
        for k, name in enumerate(self.joints):
            for one in (name, f"{name}_motor"):
                if any(self.model.joint(j).name == one for j in range(self.model.njnt)):
                    data.joint(one).qpos[0], data.joint(one).qvel[0] = q[k], dq[k]

    def _measured(self, data: mujoco.MjData) -> np.ndarray:
        if self.blocks is not None:
            return np.asarray(self.blocks.measured(data))
        return np.array([data.joint(name).qpos[0] for name in self.seen])

    def _advance(self, data: mujoco.MjData, u: np.ndarray) -> None:
        import mujoco

        if self.blocks is not None:
            for _ in range(self.ticks):
                self.blocks.step(self.model, data, u)
            return
        for k, actuator in enumerate(self.actuators):
            row: Mapping[str, Any] = self.rows.get(self.problem.joints[k], {})
            data.ctrl[actuator] = row.get("control_per_command", 1.0) * u[k]
        mujoco.mj_step(self.model, data, self.ticks)


def law_in_steps(problem: Problem, log: Log) -> Callable[[int, np.ndarray], np.ndarray]:
    """Return the law as a function of sample and measured position; it keeps its own state.

    It starts at rest where it first sees the joints, which is not where they are behind an
    encoder that is off.

    Raises
    ------
    ClieError
        If the law does not hold the joints, so that a simulation only runs away from the log.

    """
    law = problem.law
    if not isinstance(law, StatedLaw) or not law.holds_joints:
        raise ClieError("a replay needs the law that ran: state [controller] with its gains in "
                        "the robot file; without feedback a simulation leaves the log whatever "
                        "the model")
    if isinstance(law, BlockLaw):
        return _block_in_steps(law, log)
    rate = _velocity_in_steps(law, log)
    return lambda i, q: law.command(log.q_d[i] - q, rate(q), log.pe[i])


def _velocity_in_steps(law: StatedLaw, log: Log) -> Callable[[np.ndarray], np.ndarray]:
    """Return the velocity filter of a law as a function of the position at the next sample."""
    memory = list(ramp_memory(np.broadcast_to(log.speed, log.start.shape) * 1.0, law.numerator,
                              law.denominator, law.period).reshape(2, -1))
    start = None

    def rate(q: np.ndarray) -> np.ndarray:
        nonlocal start, memory
        start = q if start is None else start
        formed, after = formed_velocity(q - start, memory, law.numerator, law.denominator)
        memory = list(after)
        return formed

    return rate


def _block_in_steps(law: BlockLaw, log: Log) -> Callable[[int, np.ndarray], np.ndarray]:
    state = law.rest if log.law_state is None else log.law_state
    beyond = np.zeros_like(log.q) if log.drive_rest is None else log.drive_rest
    rate, reads, sent = _velocity_in_steps(law, log), law.block.reads, np.zeros_like(log.start)

    def command(i: int, q: np.ndarray) -> np.ndarray:
        nonlocal state, sent
        of_drive = []
        if VELOCITY in reads:
            of_drive.append(rate(q) + beyond[i, :len(q)])
        if TORQUE in reads:
            recorded = log.u[i - 1] if i else 0.0
            of_drive.append((sent - recorded) / np.array(law.block.scale)
                            + log.of_drive[TORQUE][i])
        state, u = law.block.step(i * law.period, state, log.q_d[i], q, log.pe[i], law.parameters,
                                  *of_drive)
        sent = np.clip(u, -law.saturation, law.saturation)
        return sent

    return command


def replay(problem: Problem, corrected: str | PathLike[str],
           nominal: str | PathLike[str] | None = None) -> Replay:
    """Return the gap of each joint, of the nominal and of the corrected model, and its floor.

    What sets in at a moment of a log does so where that log shows it, see `seek_moments`.

    The measured motion holds what the noise of the encoder did to it, which no simulation repeats:
    a right model leaves the floor, and not zero.

    Parameters
    ----------
    problem : Problem
        Robot, logs and law.
    corrected : path-like
        The corrected MJCF.
    nominal : path-like, optional
        The user's MJCF before the correction; by default the model that the robot file states,
        run by the blocks of this package.

    """
    model = SimulatedModel(corrected, problem)
    moments = [seek_moments(model, log) for log in problem.law_logs]
    quiet = [model.run(log, moments=of_log)
             for log, of_log in zip(problem.law_logs, moments, strict=True)]
    after = _rms([log.bridged(log.law_q - q)
                  for log, q in zip(problem.law_logs, quiet, strict=True)])
    floor = _floor(model, problem, quiet, moments)
    if nominal is None:
        stated = build_hypothesis(problem, ())
        before = _rms([stated.error(j, dithered=False) for j in range(len(problem.logs))
                       if not problem.logs[j].of_other_encoder])
    else:
        user = SimulatedModel(nominal, problem)
        before = _rms([log.bridged(log.law_q - user.run(log)) for log in problem.law_logs])
    unit = problem.records[0].units["q"]
    gaps = [JointGap(name, unit[k] if unit[k] == "m" else "rad", float(before[k]),
                     float(after[k]), float(floor[k]))
            for k, name in enumerate(problem.joints)]
    return Replay(gaps, [SetIn(Path(log.name).name, joint, parameter, moment)
                         for log, of_log in zip(problem.law_logs, moments, strict=True)
                         for (joint, parameter), moment in zip(model.events, of_log, strict=True)])


def _floor(model: SimulatedModel, problem: Problem, quiet: list[np.ndarray],
           moments: list[list[float]]) -> np.ndarray:
    """RMS of what noise of the encoders does to a model: as it is seen, and through the loop."""
    sigma = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    rng = np.random.default_rng(0)
    noise = [sigma * rng.standard_normal(q.shape) for q in quiet]
    return _rms([log.bridged(model.run(log, one, of_log) + one - q) for log, one, q, of_log in zip(
        problem.law_logs, noise, quiet, moments, strict=True)])


def _rms(errors: list[np.ndarray]) -> np.ndarray:
    return np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))
