"""What a simulator was to run, by its model file and the robot file, as a problem of its logs.

The problem holds all that a fault could change, with the values that the files state: the tick,
the limit, the delay and the gain of the drive, and dry friction, hard or soft.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.drive import (
    ACTUATOR_SATURATION,
    PACKET_HOLD,
    TIME_DELAY,
    TORQUE_GAIN_ERROR,
)
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.load import SPRING
from clie_blocks.analysis.gap.fitting.hypothesis import Member, held_members
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.nominal import Nominal
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.stated_law import pose_of
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.gap.simulator_comparison.difference import (
    SAME_JOINT_MODEL,
    without_noise,
)
from clie_blocks.analysis.gap.simulator_comparison.integrator import with_integrator
from clie_blocks.analysis.gap.simulator_faults.model_file import ModelFile
from clie_blocks.analysis.gap.simulator_faults.soft_friction import SOFT_FRICTION
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.errors import NotIdentifiableError

FLOOR = 4e-4  # of the travel of a joint: what engines and steps differ by counts as noise
ROUNDED = 0.1  # of a change that counts as none: files state what their simulator runs
NO_LIMIT = 1e6  # N m
LEAD = 0.75  # steps of the file, by which an integrator may lead or lag: half a step is usual
LEAST_LEAD = 0.1  # periods


@dataclasses.dataclass(frozen=True, eq=False)
class StatedRun:
    """A run as its files state it, and the joints at which a fault is tried.

    Parameters
    ----------
    problem : Problem
        Logs, and what the files state as the nominal model.
    model : ModelFile
        The model file.
    at : ndarray of bool, shape (n,)
        Joints with the fault.

    """

    problem: Problem
    model: ModelFile
    at: np.ndarray

    @property
    def whole(self) -> bool:
        """Whether all joints have it."""
        return bool(self.at.all())

    @property
    def gear(self) -> np.ndarray:
        """Gear ratios, shape (n,)."""
        return self.problem.gear_ratio

    def joint_model(self, **changes: np.ndarray) -> StatedRun:
        """Return the run with other numbers of the joint model, motor side, at the joints."""
        nominal = self.problem.nominal
        values = {key: np.where(self.at, value, getattr(nominal, key))
                  for key, value in changes.items()}
        change: Callable[..., Nominal] = dataclasses.replace
        return self._of(nominal=change(nominal, **values))

    def effect(self, name: str, **values: np.ndarray) -> StatedRun:
        """Return the run with other values of an effect that it holds, at the joints."""
        def changed(member: Member) -> Member:
            return dataclasses.replace(member, values={**member.values, **{
                key: np.where(self.at, value, member.values[key])
                for key, value in values.items()}})

        return self._of(inside=tuple(changed(member) if member.name == name else member
                                     for member in held_members(self.problem)))

    def gains(self, factor: float) -> StatedRun:
        """Return the run with both gains times a factor, at the joints."""
        law = self.problem.stated_law
        return self._of(law=dataclasses.replace(
            law, kp=np.where(self.at, factor * law.kp, law.kp),
            kd=np.where(self.at, factor * law.kd, law.kd)))

    def gravity(self, factor: float) -> StatedRun:
        """Return the run with a multiple of gravity."""
        links = self.problem.links
        return self._of(links=links.with_gravity(factor * links.gravity))

    def links_of(self, robot: Robot) -> StatedRun:
        """Return the run with the links of another robot file."""
        links = stated_links(robot, pose_of(robot, self.problem.records[0]))
        links = dataclasses.replace(links, bearing_damping=self.problem.links.bearing_damping)
        nominal, old = self.problem.nominal, self.problem.links
        inertia = nominal.inertia + (links.diagonal - old.diagonal) / self.gear
        return self._of(links=links, nominal=dataclasses.replace(nominal, inertia=inertia))

    def earlier_references(self, count: int) -> StatedRun:
        """Return the run whose law gets set-points and excitations some periods early."""
        def early(signal: np.ndarray) -> np.ndarray:
            ahead = np.concatenate([signal[count:], np.repeat(signal[-1:], count, axis=0)])
            return np.where(self.at, ahead, signal)

        def advanced(log: Log) -> Log:
            return dataclasses.replace(log, q_d=early(log.q_d), pe=early(log.pe))

        return dataclasses.replace(self, problem=self.problem.with_logs(advanced))

    def any_lead(self) -> StatedRun:
        """Return the run whose integrator may lead by more than the step of the file allows."""
        without = tuple(one for one in self.problem.inside if one.name != "integrator_lead")
        return dataclasses.replace(self, problem=with_integrator(
            dataclasses.replace(self.problem, inside=without)))

    def _of(self, **changes: object) -> StatedRun:
        change: Callable[..., Problem] = dataclasses.replace
        return dataclasses.replace(self, problem=change(self.problem, **changes))


def stated_run(robot: Robot, records: Sequence[Record], model: ModelFile) -> StatedRun:
    """Return what a simulator was to run, beside its logs.

    Parameters
    ----------
    robot : Robot
        The robot file: control law, gear ratio and links.
    records : sequence of Record
        Logs of the simulator; all of them are fitted.
    model : ModelFile
        What the simulator was to run.

    Raises
    ------
    NotIdentifiableError
        If the robot file states no law that could be run.

    """
    problem = Problem.from_logs(_with_drives_of(robot, model), records, held_out=(),
                                trust_logs=True)
    if not isinstance(problem.law, StatedLaw) or not problem.law.holds_joints:
        raise NotIdentifiableError("faults of a simulator are told by its closed loop: state "
                                   "[controller] with its gains in the robot file")
    travel = np.max([np.ptp(log.q, axis=0) for log in problem.logs], axis=0)
    problem = without_noise(dataclasses.replace(
        _nearly_exact(problem, model), resolution=np.maximum(problem.resolution, FLOOR * travel),
        inside=_members(problem, model)))
    lead = max(LEAD * model.step / problem.period, LEAST_LEAD)
    return StatedRun(with_integrator(problem, lead), model, np.ones(problem.n, bool))


def _with_drives_of(robot: Robot, model: ModelFile) -> Robot:
    """Robot file with rotor and damping of the model, where it states none of its own."""
    ratio = np.ones(robot.n) if robot.motor.gear_ratio is None else robot.motor.gear_ratio
    of_model = {"inertia": model.armature / ratio**2, "viscous_friction": model.damping / ratio**2}
    missing = {key: value for key, value in of_model.items() if getattr(robot.motor, key) is None}
    return dataclasses.replace(robot, motor=dataclasses.replace(robot.motor, **missing))


def _nearly_exact(problem: Problem, model: ModelFile) -> Problem:
    """Problem whose joint model is known as well as a file states it.

    What a spring of the joint pulls at its zero is a part of the constant load.
    """
    torque = np.sqrt(np.mean(np.concatenate([log.u for log in problem.logs]) ** 2, axis=0))
    scale = {"inertia": problem.nominal.inertia, "damping": problem.nominal.damping,
             "load": torque}
    tolerances = {f"{name}_tolerance": ROUNDED * share * np.abs(scale[name]) + 1e-12
                  for name, share in SAME_JOINT_MODEL.items()}
    change: Callable[..., Nominal] = dataclasses.replace
    return dataclasses.replace(problem, nominal=change(
        problem.nominal, **tolerances, load=-model.stiffness * model.rest / problem.gear_ratio))


def _members(problem: Problem, model: ModelFile) -> tuple[Member, ...]:
    """All that a fault could change, as it is stated."""
    one, nominal = np.ones(problem.n), problem.nominal
    springs = [_held(SPRING, stiffness=model.stiffness / problem.gear_ratio)
               ] if model.stiffness.any() else []
    return (
        *springs,
        _held(PACKET_HOLD, hold=0.0 * one, interval=problem.period * one, phase=0.0 * one),
        _held(ACTUATOR_SATURATION, limit=np.minimum(model.limit, NO_LIMIT)),
        _held(TIME_DELAY, delay=model.delay),
        _held(TORQUE_GAIN_ERROR, error=0.0 * one),
        _held(COULOMB, level=model.friction / problem.gear_ratio),
        _held(SOFT_FRICTION, level=0.0 * one, inertia=nominal.inertia, damping=nominal.damping))


def _held(cause: Cause, **values: np.ndarray) -> Member:
    """Effect with numbers that no fit moves."""
    fixed = dataclasses.replace(cause, numbers=tuple(
        dataclasses.replace(number, fixed=True, scope="joint") for number in cause.numbers))
    return Member(fixed, tuple(range(len(next(iter(values.values()))))), dict(values),
                  {name: 0.0 * value for name, value in values.items()})
