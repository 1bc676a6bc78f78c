"""A MuJoCo model under the law of a problem, in the experiments of its logs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.export.correction import check_joint_names
from clie_blocks.analysis.export.events import Phase
from clie_blocks.analysis.export.mujoco_engine import load
from clie_blocks.analysis.export.mujoco_target import DRIVEN, SCHEMA_VERSION
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.joint_side import logged_command, turn
from clie_blocks.errors import ClieError, DivergedError, RecordError
from clie_blocks.rigid_body.motor_coupling import inverse_of
from clie_blocks.robot_loop.block import ramp_memory
from clie_blocks.robot_loop.dynamics import formed_velocity
from clie_blocks.robot_loop.sampled_law import TORQUE, VELOCITY
from clie_blocks.user_files import run_file

if TYPE_CHECKING:
    import mujoco

FAR = 100.0  # times the largest motion of a log: a simulation as far off has diverged


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
        self.coupling = problem.links.motor_coupling
        self.model = load(text, file.name, file.parent)
        beside = file.with_name(DRIVEN)
        told = json.loads(beside.read_text()) if beside.is_file() else {"joints": []}
        if told.get("model") == file.name and told["schema_version"] != SCHEMA_VERSION:
            raise ClieError(f"{beside} was written by another version of clie export, which "
                            "meant something else by it: export the answer again")
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
        self.seen = [self._seen(k, is_corrected) for k in range(problem.n)]
        self.actuators = [self._actuator(name) for name in self.joints]
        self.ticks = round(problem.period / self.model.opt.timestep)
        if abs(self.ticks * self.model.opt.timestep / problem.period - 1.0) > 1e-3:
            raise ClieError(f"{file.name} steps by {self.model.opt.timestep:g} s, and the "
                            f"controller of the logs runs every {problem.period:g} s: set option "
                            "timestep to that, or to a fraction of it")

    def _seen(self, k: int, is_corrected: bool) -> dict[str, float]:
        """Shares of the joints that an encoder sees."""
        row = self.rows.get(self.problem.joints[k], {})
        if is_corrected:
            return dict(row["seen"])
        if self.coupling is None:
            return {self.joints[k]: 1.0}
        return dict(zip(self.joints, inverse_of(self.coupling)[k]))

    def _actuator(self, joint: str) -> int:
        """Number of the actuator of a joint, of the motor in front of its gear, or of a tendon."""
        import mujoco

        own = {joint, f"{joint}_motor"}
        kinds = {int(mujoco.mjtTrn.mjTRN_JOINT): self.model.joint,
                 int(mujoco.mjtTrn.mjTRN_TENDON): self.model.tendon}
        found = [k for k in range(self.model.nu) if self.model.actuator_trntype[k] in kinds
                 and kinds[int(self.model.actuator_trntype[k])](
                     int(self.model.actuator_trnid[k, 0])).name in own]
        if len(found) != 1:
            of_motor = "" if self.coupling is None else (
                ", and at a tendon that is the motor of several joints, as clie export writes it")
            raise ClieError(f"{self.name}: {len(found)} actuators drive {joint}, and the law of "
                            "the logs needs one, whose control is its command: a <motor>"
                            + of_motor)
        return found[0]

    @property
    def events(self) -> list[tuple[str, str]]:
        """Joint and parameter of what sets in at some moment, which a run may set."""
        return [] if self.blocks is None else [
            (name, parameter) for name in self.problem.joints
            for parameter in self.rows[name].get("events", [])]

    @property
    def phases(self) -> list[Phase]:
        """Phases of what comes again and again, which a run may set."""
        return [] if self.blocks is None else [
            Phase(name, **row) for name in self.problem.joints
            for row in self.rows[name].get("phases", [])]

    def run(self, log: Log, noise: np.ndarray | None = None,
            own: Mapping[tuple[str, str], float] | None = None) -> np.ndarray:
        """Positions under the law of the problem in the experiment of a log, shape (N, n).

        The law sees them with some noise of the sensor (N, n) [rad], by default with none: what
        it sees first is the first position of the log.  `own` holds values of parameters that are
        of this log alone, by joint and name: moments of `events`, which are there from the start
        by default, and phases.
        """
        import mujoco

        as_exported = dict.fromkeys(self.events, 0.0)
        for phase in self.phases:
            as_exported |= phase.later(0.0)
        for (joint, parameter), value in (as_exported | dict(own or {})).items():
            self.blocks.set(joint, parameter, value)  # type: ignore[union-attr]
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
        sees = np.array([[one.get(name, 0.0) + one.get(f"{name}_motor", 0.0)
                          for name in self.joints] for one in self.seen])
        q, dq = np.linalg.solve(sees, q), np.linalg.solve(sees, dq)
        for k, name in enumerate(self.joints):
            for one in (name, f"{name}_motor"):
                if any(self.model.joint(j).name == one for j in range(self.model.njnt)):
                    data.joint(one).qpos[0], data.joint(one).qvel[0] = q[k], dq[k]

    def _measured(self, data: mujoco.MjData) -> np.ndarray:
        if self.blocks is not None:
            return np.asarray(self.blocks.measured(data))
        return np.array([sum(share * data.joint(name).qpos[0] for name, share in one.items())
                         for one in self.seen])

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
