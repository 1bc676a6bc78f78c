"""The corrected model as a simulator of joints takes it: joint side, with sign and unit.

A simulator moves a joint by ``armature ddq = gear gain u + offset - damping dq - drag dq |dq|
- stiffness q``, less dry friction of at most ``frictionloss``; the links come with their bodies.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import is_number, ratio_change
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.problem.preparation import QUARTER_TURN, torque_at_full_duty
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.wording import local_unit
from clie_blocks.analysis.records.command_unit import force_per_command, missing_force

UNREACHED = 1e6  # a limit beyond it is none
Values = Mapping[str, np.ndarray]


@dataclasses.dataclass(frozen=True)
class Place:
    """A parameter of a joint in a simulator: its unit, what it is, and its names.

    The unit is written for an axis that turns; `per_command` marks one that is the command's.
    """

    unit: str
    meaning: str
    mujoco: str
    urdf: str
    isaac: str
    per_command: bool = False


PLACES = {
    "armature": Place("kg m^2", "inertia about the joint beside that of the links",
                      "joint armature", "-", "armature"),
    "mass": Place("kg", "mass that slides", "body inertial mass", "<inertial><mass>", "mass"),
    "damping": Place("N m s/rad", "opposes the velocity", "joint damping", "<dynamics damping>",
                     "viscousFriction"),
    "drag": Place("N m s^2/rad^2", "opposes the square of the velocity",
                  "joint damping, second number", "-", "-"),
    "frictionloss": Place("N m", "dry friction, largest torque against the motion",
                          "joint frictionloss", "<dynamics friction>", "dynamicFrictionEffort"),
    "stiffness": Place("N m/rad", "pulls to position 0", "joint stiffness",
                       "<spring_stiffness>", "drive stiffness"),
    "offset": Place("N m", "constant, pushes forward where it is positive",
                    "motor biasprm, over gear", "-", "effort offset"),
    "gear": Place("1", "motor turns per joint turn", "motor gear", "mechanicalReduction",
                  "scale of the effort"),
    "gain": Place("N m", "motor side, delivered per unit of command", "motor gainprm", "-",
                  "scale of the effort", per_command=True),
    "limit": Place("u", "motor side, of the command", "motor ctrlrange",
                   "<limit effort>, times gain and gear",
                   "effort_limit, times gain and gear"),
    "lag": Place("s", "time constant of the motor", "motor dyntype filterexact, dynprm", "-", "-"),
    "delay": Place("s", "from command to torque", "motor delay, nsample", "-",
                   "DelayedPDActuator max_delay"),
}
ADDED = ("armature", "mass", "damping", "drag", "frictionloss", "stiffness", "offset", "lag",
         "delay")
HELD_BY_PLACES = {
    "coulomb", "asymmetric_coulomb", "quadratic_drag", "spring", "actuator_saturation",
    "actuator_lag", "time_delay", "torque_gain_error", "gravity", "payload", "coupling"}


@dataclasses.dataclass(frozen=True)
class Entry:
    """One parameter of one joint: corrected, what it was before, and its unit."""

    joint: str
    parameter: str
    value: float
    before: float
    unit: str

    @property
    def change(self) -> float:
        """Corrected less before."""
        return self.value - self.before


def only_differences(result: Result) -> bool:
    """Whether the user's simulator already holds the rest: its logs were compared, or its loop."""
    return bool(result.problem.simulated) or result.problem.statement is None


def why_not_exported(result: Result) -> str | None:
    """Why the corrected model is not known in SI, and what to state to get it; None if it is."""
    return missing_force(result.problem.records[0]) if result.problem.records else None


def entries(result: Result) -> list[Entry]:
    """Every parameter of the corrected joints, beside what was stated or simulated.

    Raises
    ------
    ValueError
        If the command is not known in N m or N, see `why_not_exported`.

    """
    hypothesis = result.model.hypothesis
    problem = hypothesis.problem
    after = _joints(problem, hypothesis.all_members, hypothesis.values)
    before = _joints(problem, _inside(problem), _nominal_values(problem))
    return [Entry(problem.joints[k], name, float(after[name][k]), float(before[name][k]),
                  unit_at(problem, k, place))
            for k in range(problem.n) for name, place in _places(problem, k)]


def _places(problem: Problem, k: int) -> Iterator[tuple[str, Place]]:
    """Parameters of a joint: one that slides has a mass, one that turns an armature."""
    other = "armature" if slides(problem, k) else "mass"
    return ((name, place) for name, place in PLACES.items() if name != other)


def slides(problem: Problem, k: int) -> bool:
    """Whether a joint slides, in m, and does not turn."""
    return bool(problem.records) and problem.records[0].units["q"][k] == "m"


def _inside(problem: Problem) -> Sequence[Member]:
    return problem.inside  # type: ignore[return-value]


def _nominal_values(problem: Problem) -> Values:
    """Values of what the nominal model is: the datasheet, or the user's simulator."""
    return {"inertia": problem.nominal.inertia, "damping": problem.nominal.damping,
            "load": problem.nominal.load,
            **{f"{member.name}.{name}": value for member in _inside(problem)
               for name, value in member.values.items()}}


def unit_at(problem: Problem, k: int, place: Place) -> str:
    """Unit of a parameter at a joint, in SI, or that of its command."""
    if not problem.records:
        return place.unit
    record = problem.records[0]
    command, force = logged_command(problem)[1][k], "N" if slides(problem, k) else "N m"
    if place.unit == "u":
        return command
    unit = local_unit(place.unit, {"q": record.units["q"][k], "u": force})
    if place.per_command:
        return "1" if command == force else f"{unit}/{command}"
    return unit


def turn(problem: Problem) -> np.ndarray:
    """Position of the logs in which links point along the horizontal [rad], shape (n,).

    Zero, but for machines whose zero hangs down: the diagnosis has turned their positions.
    """
    if problem.statement is None or not problem.records:
        return np.zeros(problem.n)
    logged, used = problem.statement.records[0].q, problem.records[0].q
    return np.where(np.abs(logged[0] - used[0] - QUARTER_TURN) < 1e-6, QUARTER_TURN, 0.0)


def force_of(problem: Problem) -> np.ndarray:
    """Torque or force per unit of command, shape (n,); one where no log says."""
    if not problem.records:
        return np.ones(problem.n)
    force = force_per_command(problem.records[0])
    if force is None:
        raise ValueError("the command is not known in N m or N")
    return force


def joint_torque(problem: Problem, values: Values) -> np.ndarray:
    """Torque at the joint per torque of a fitted model, shape (n,), with the ratio that it found.

    A model with another ratio is eq. (8) motor side, over the change of the ratio.
    """
    return force_of(problem) * problem.gear_ratio * ratio_change(values, problem.n) ** 2


def logged_command(problem: Problem) -> tuple[np.ndarray, tuple[str, ...]]:
    """Command of the diagnosis per command of the logs, shape (n,), and the unit of the latter.

    A current or a duty cycle may have become a torque on the way.
    """
    one = np.ones(problem.n)
    if not problem.records:
        return one, ("N m",) * problem.n
    used = tuple(problem.records[0].units["u"])
    if problem.statement is None:
        return one, used
    robot = problem.statement.robot
    logged = problem.statement.records[0].replace(robot=robot)
    full = torque_at_full_duty(robot)
    if robot.controller.law == "servo" and full is not None:
        return full, ("duty",) * problem.n
    force, unit = force_per_command(logged), tuple(logged.units["u"])
    return (one, used) if unit == used or force is None else (force, unit)


def _joints(problem: Problem, members: Iterable[Member], values: Values) -> dict[str, np.ndarray]:
    """Parameters of all joints by name of `PLACES`, each of shape (n,)."""
    force, change = force_of(problem), ratio_change(values, problem.n)
    torque = joint_torque(problem, values)
    zero = np.zeros(problem.n)
    forward, backward = _friction(values, zero)
    gain, limit = _drive(members, values, problem.n)
    command, _ = logged_command(problem)
    inertia = torque * values["inertia"] - change**2 * problem.links.diagonal
    bearing = (change**2 - 1.0) * problem.links.bearing_damping
    return {
        "armature": inertia, "mass": inertia,
        "damping": torque * values["damping"] - bearing,
        "drag": torque * values.get("quadratic_drag.drag", zero),
        "frictionloss": torque * (forward + backward) / 2,
        "stiffness": torque * values.get("spring.stiffness", zero),
        "offset": -torque * (values["load"] + (forward - backward) / 2),
        "gear": change * problem.gear_ratio, "gain": force * gain * command,
        "limit": limit / command,
        "lag": values.get("actuator_lag.lag", zero),
        "delay": values.get("time_delay.delay", zero)}


def _friction(values: Values, zero: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest dry friction against forward and backward motion, as far as it is constant.

    What the two directions differ by is a constant torque, at rest and in motion.
    """
    even = sum((values[key] for key in ("coulomb.level", "stribeck.level",
                                        "load_dependent_friction.level",
                                        "load_dependent_friction_links.level")
                if key in values), zero)
    return (even + values.get("asymmetric_coulomb.forward", zero),
            even + values.get("asymmetric_coulomb.backward", zero))


def _drive(members: Iterable[Member], values: Values, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gain of the drive, and its limit as one of the command in front of that gain."""
    gain, limit = np.ones(n), np.full(n, np.inf)
    for member in members:
        if member.cause.name == "torque_gain_error":
            gain = gain * (1.0 + values[f"{member.name}.error"])
        if member.cause.name == "actuator_saturation":
            stated = values[f"{member.name}.limit"] / gain
            limit = np.minimum(limit, np.where(stated < UNREACHED, stated, np.inf))
    return gain, limit


def controller_entries(result: Result) -> list[dict[str, Any]]:
    """What ran in the controller instead of the stated law: parameter, joint, value, stated."""
    check, problem = result.controller, result.problem
    rows: list[dict[str, Any]] = []
    gains = {"kp": "N m/rad", "kd": "N m s/rad"}
    for k in check.other_gains:
        rows += [_of_controller(problem, k, name.capitalize(), getattr(check.law, name)[k],
                                getattr(problem.law, name)[k], unit)
                 for name, unit in gains.items()]
    for k in check.other_filter:
        stated = getattr(problem.law, "corners", None) or (None, None)
        rows += [_of_controller(problem, k, name, check.corners[i, k], stated[i], "1/s")
                 for i, name in enumerate(("velocity_filter_highpass", "velocity_filter_lowpass"))]
    rows += [_of_controller(problem, k, "Ki", gain, 0.0, "N m/(rad s)")
             for k, gain in enumerate(check.integral) if gain]
    rows += [_of_controller(problem, one.joint, one.name, one.value, one.stated, "")
             for one in check.parameters]
    if check.delayed:
        rows += [_of_controller(problem, k, "command_delay", problem.period, 0.0, "s")
                 for k in range(problem.n)]
    return rows


def _of_controller(problem: Problem, k: int | None, name: str, value: float, stated: float | None,
                   unit: str) -> dict[str, Any]:
    joint = "the robot" if k is None else problem.joints[k]
    return {"parameter": name, "joint": joint, "value": float(value),
            "stated": None if stated is None else float(stated),
            "unit": unit.replace("1/s", "rad/s")}


def left_out(result: Result) -> Iterator[tuple[Member, tuple[tuple[str, np.ndarray, str], ...]]]:
    """Causes that no attribute of a joint or a motor holds, with their parameters, joint side.

    Yields each member, and name, values at its joints and unit of each of its parameters.
    """
    hypothesis = result.model.hypothesis
    problem = hypothesis.problem
    torque = joint_torque(problem, hypothesis.values)
    for member in hypothesis.members:
        if is_held(problem, member) or is_number(member.cause):
            continue
        at = list(member.joints)
        yield member, tuple(
            (number.name, _joint_side(hypothesis.values[f"{member.name}.{number.name}"][..., at],
                                      number.unit, torque[at]),
             unit_at(problem, at[0], Place(number.unit, "", "", "", "")))
            for number in member.cause.numbers if not number.switch)


def is_held(problem: Problem, member: Member) -> bool:
    """Whether the attributes of joints, motors, bodies and gravity hold a cause."""
    if member.cause.name == "time_delay":
        return not member.cause.variant
    return member.cause.name in HELD_BY_PLACES


def _joint_side(value: np.ndarray, unit: str, torque: np.ndarray) -> np.ndarray:
    return torque * value if unit.startswith("N m") else value


def exported(result: Result) -> dict[str, Any]:
    """The export as plain types: joint side in SI, or why there is none."""
    why, basis = why_not_exported(result), "datasheet"
    if only_differences(result):
        basis = "simulator" if result.problem.simulated else "loop"
    plain: dict[str, Any] = {"basis": basis, "not_exported": why,
                             "controller": controller_entries(result),
                             "joints": [], "not_in_the_table": []}
    if why is not None:
        return plain
    return plain | {
        "joints": [_plain(entry) for entry in entries(result)],
        "not_in_the_table": [
            {"effect": member.cause.name,
             "joints": [result.problem.joints[k] for k in member.joints],
             "parameters": {name: {"value": np.ravel(value), "unit": unit}
                            for name, value, unit in parameters}}
            for member, parameters in left_out(result)]}


def _plain(entry: Entry) -> dict[str, Any]:
    """Entry as plain types; None for a limit that is not there."""
    value, before = (x if np.isfinite(x) else None for x in (entry.value, entry.before))
    change = None if value is None else value if before is None else value - before
    return {"joint": entry.joint, "parameter": entry.parameter, "value": value,
            "before": before, "change": change, "unit": entry.unit}
