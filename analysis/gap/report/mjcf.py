"""The corrected model as a MuJoCo model that runs as written, or as changes of the user's."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import corrected_links, zero_change
from clie_blocks.analysis.gap.causes.load import corrected_gravity
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.problem.preparation import QUARTER_TURN
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.joint_side import (
    ADDED,
    PLACES,
    Entry,
    controller_entries,
    entries,
    joint_torque,
    left_out,
    logged_command,
    only_differences,
    slides,
    why_not_exported,
)
from clie_blocks.analysis.gap.report.wording import MIXED, units_of, with_prefix
from clie_blocks.rigid_body.motor_coupling import inverse_of
from clie_blocks.robot_loop.links import Links

LONGEST_STEP = 1.25e-4  # s: of MuJoCo, whose dry friction then holds as in the corrected model
SPECK = 1e-9  # kg, kg m^2: the engine refuses bodies without mass, and armature brings the inertia
WEIGHT_SHARE = 0.01  # of a joint's inertia, that a body takes which only weighs

Attributes = Mapping[str, str | float]


def corrected_model(result: Result) -> str:
    """Text of ``NAME.xml``: what a simulator needs in order to move as the corrected model.

    A model of its own that runs as it is written; against the user's simulator, the changes that
    bring it there; only a comment where the command is not known in N m or N.
    """
    why = why_not_exported(result)
    if why is not None:
        return _element("mujoco", {}, [_comment(
            f"No values: torques of this diagnosis are per unit of u, and {why}.")])
    rows = entries(result)
    return _changes(result, rows) if only_differences(result) else _model(result, rows)


def _model(result: Result, rows: Sequence[Entry]) -> str:
    """Bodies, joints and motors of the corrected model, with gravity and a step."""
    hypothesis = result.model.hypothesis
    step = mujoco_step(hypothesis.problem.period)
    parts = [
        *map(_comment, _how_to_use(result, step)), *_notes(result),
        _element("compiler", {"angle": "radian", "autolimits": "true"}),
        _element("option", {"timestep": step, "integrator": "implicitfast",
                            "gravity": _gravity(hypothesis.problem.links, hypothesis.values)}),
        _element("worldbody", {}, list(_bodies(result, rows, step))),
        *_tendons(result, rows, step),
        _element("actuator", {}, [_motor(joint, row, hypothesis.problem)
                                  for joint, row in _by_joint(rows).items()])]
    return _element("mujoco", {"model": "corrected"}, parts) + "\n"


def mujoco_step(period: float) -> float:
    """Step of MuJoCo [s]: a whole number of them is the period of the controller."""
    return period / math.ceil(period / LONGEST_STEP - 1e-9)


def _how_to_use(result: Result, step: float) -> Iterator[str]:
    problem = result.model.hypothesis.problem
    q, u = _units(problem)
    yield (f"Verdict: {result.verdict}. {_prediction(result, q)} Every value is on the joint side "
           "but for gainprm, ctrlrange and the times of a motor.")
    yield ("Load this file as it is, or give your own joints and motors every attribute of those "
           "of the same name here; armature does not contain the inertia of the links, since "
           "their bodies bring it; an axis that slides has the mass of its body.")
    at = ("data.qpos is the position" if problem.links.motor_coupling is None else
          "data.ten_length holds the positions of the motors over their gear ratios")
    yield (f"{at} [{q}]. Write the command of your controller, u as logged "
           f"[{u}], to data.ctrl every {problem.period:.9g} s, which is "
           f"{round(problem.period / step)} steps of {step:.9g} s. Start at the first position of "
           "the log.")


def _prediction(result: Result, unit: str) -> str:
    """What the corrected model predicts, on which data."""
    reduction = result.reduction
    before, after = (with_prefix(value, unit)
                     for value in (reduction.before, reduction.after))
    driven = "" if result.problem.law.holds_joints else (
        " with an observer, since no controller holds this machine")
    return (f"Predicted RMS error on {reduction.judged_on}{driven}: {after}, "
            f"refitted nominal model {before}.")


def _units(problem: Problem) -> tuple[str, str]:
    """Units of positions and commands."""
    if not problem.records:
        return "rad", "N m"
    return units_of(problem.records)["q"], MIXED.join(dict.fromkeys(logged_command(problem)[1]))


def _notes(result: Result) -> Iterator[str]:
    """Comments on what no attribute holds: the controller, and causes of other kinds."""
    for row in controller_entries(result):
        stated = "not stated" if row["stated"] is None else f"{row['stated']:.6g} stated"
        yield _comment(f"Controller of {row['joint']}: {row['parameter']} {row['value']:.6g} "
                       f"{row['unit']} ran, {stated}." + (
                           " It is in the delay of the motor."
                           if row["parameter"] == "command_delay" else
                           " Your controller needs it."))
    problem = result.model.hypothesis.problem
    for member, parameters in left_out(result):
        values = ", ".join(f"{name} {_list(value)} {unit}" for name, value, unit in parameters)
        joints = ", ".join(problem.joints[k] for k in member.joints)
        yield _comment(f"Not in this file: {member.cause.name} at {joints}, {values}; without it "
                       "the error stays larger than predicted.")
    for finding in result.findings:
        values = ", ".join(f"{name} {_list(entry['value'])} {entry['unit']}"
                           for name, entry in finding.parameters.items())
        joints = ", ".join(problem.joints[k] for k in finding.joints)
        yield _comment(f"Not in this file: {finding.effect} at {joints}, {values}; found on the "
                       "path of the command, without the motion.")


def _list(value: np.ndarray) -> str:
    return " ".join(f"{x:.6g}" for x in np.atleast_1d(np.asarray(value, float)).ravel())


def _by_joint(rows: Iterable[Entry]) -> dict[str, dict[str, Entry]]:
    joints: dict[str, dict[str, Entry]] = {}
    for row in rows:
        joints.setdefault(row.joint, {})[row.parameter] = row
    return joints


def _gravity(links: Links, values: Mapping[str, np.ndarray]) -> str:
    """Gravity of the corrected model; of links that are not stated, bodies bring the weight."""
    if not links.known:
        return f"0 0 {-float(links.g):.9g}"
    if not links.is_planar:
        return _numbers(corrected_gravity(links, values))
    along, across = (float(values[key].flat[0]) if key in values else 0.0
                     for key in ("gravity.along", "gravity.across"))
    x, z = (0.0 - links.g * share for share in (across, links.has_gravity + along))
    return f"{x:.9g} 0 {z:.9g}"


def _bodies(result: Result, rows: Sequence[Entry], step: float) -> Iterator[str]:
    hypothesis = result.model.hypothesis
    problem, values = hypothesis.problem, hypothesis.values
    joints = list(_by_joint(rows).values())
    if not problem.links.known:
        for k, row in enumerate(joints):
            if slides(problem, k):
                body, taken = _inertial("0 0 0", row["mass"].value, 0.0), 0.0
            else:
                body, taken = _weight(problem, values, k, row["armature"].value)
            yield _body(f"0 {k} 0", _joint(hypothesis, k, row, step, taken), body)
        return
    links = corrected_links(problem.links, values)
    if not problem.links.is_planar:
        yield from _tree(links, hypothesis, joints, step)
        return
    inside: list[str] = _payload(links, values)
    for k in reversed(range(problem.n)):
        at = "0 0 0" if k == 0 else f"{links.length[k - 1]:.9g} 0 0"
        link = _inertial(f"{links.com[k, 0]:.9g} 0 0", links.mass[k], links.spin_inertia[k])
        inside = [_body(at, _joint(hypothesis, k, joints[k], step), link, inside)]
    yield from inside


def _tree(links: Links, hypothesis: Hypothesis, joints: Sequence[Mapping[str, Entry]],
          step: float) -> Iterator[str]:
    """Bodies of the links of any arm, each in the frame of its joint."""
    from scipy.spatial.transform import Rotation

    inside: list[list[str]] = [[] for _ in range(links.n)]
    inside[-1] = _payload(links, hypothesis.values)
    for k in reversed(range(links.n)):
        x, y, z, w = Rotation.from_matrix(links.rotation[k].astype(float)).as_quat()
        about_com = links.inertia[k, [0, 3, 5, 1, 2, 4]] + SPECK * np.array([1, 1, 1, 0, 0, 0])
        body = _element(
            "body", {"pos": _numbers(links.offset[k]), "quat": _numbers((w, x, y, z))},
            [_element("inertial", {"pos": _numbers(links.com[k]),
                                   "mass": max(float(links.mass[k]), SPECK),
                                   "fullinertia": _numbers(about_com)}),
             _joint(hypothesis, k, joints[k], step, axis="0 0 1"), *inside[k]])
        if links.parents[k] < 0:
            yield body
        else:
            inside[links.parents[k]].insert(0, body)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{float(value):.9g}" for value in values)


def _body(at: str, joint: str, inertial: str, inside: Sequence[str] = ()) -> str:
    return _element("body", {"pos": at}, [inertial, joint, *inside])


def _inertial(at: str, mass: float, inertia: float) -> str:
    about = f"{max(inertia, SPECK):.9g}"
    return _element("inertial", {"pos": at, "mass": max(mass, SPECK),
                                 "diaginertia": f"{about} {about} {about}"})


def _payload(links: Links, values: Mapping[str, np.ndarray]) -> list[str]:
    if "payload.mass" not in values:
        return []
    return [_element("body", {"name": "payload", "pos": _numbers(links.along[-1])},
                     [_inertial("0 0 0", float(values["payload.mass"].flat[0]), 0.0)])]


def _weight(problem: Problem, values: Mapping[str, np.ndarray], k: int, armature: float,
            ) -> tuple[str, float]:
    """Body of a joint without stated links, which only weighs, and the inertia that it takes."""
    torque = np.array([values[key][..., k] if key in values else 0.0
                       for key in ("gravity.along", "gravity.across")], float)
    torque = torque * joint_torque(problem, values)[k]
    size = float(np.hypot(torque[0], torque[1]))
    if size == 0.0:
        return _inertial("0 0 0", 0.0, 0.0), 0.0
    taken = WEIGHT_SHARE * armature
    mass = size**2 / (taken * float(problem.links.g) ** 2)
    x, z = torque / (mass * problem.links.g)
    return _inertial(f"{x:.9g} 0 {z:.9g}", mass, 0.0), taken


def _joint(hypothesis: Hypothesis, k: int, row: Mapping[str, Entry], step: float,
           taken: float = 0.0, axis: str = "") -> str:
    problem = hypothesis.problem
    zero = _zeros(hypothesis)
    found: dict[str, str | float] = {
        "name": problem.joints[k], "type": "slide" if slides(problem, k) else "hinge",
        "axis": axis or ("0 1 0" if slides(problem, k) else "0 -1 0")}
    at, = problem.links.at_joints(zero)
    if problem.links.motor_coupling is None:
        found |= _resistance(row, step, taken)
        if row["stiffness"].value:
            found |= {"stiffness": row["stiffness"].value, "springref": zero[k]}
    if at[k]:
        found |= {"ref": at[k]}
    return _element("joint", found)


def _zeros(hypothesis: Hypothesis) -> np.ndarray:
    """Positions that the logs have where links and springs are at zero [rad], shape (n,)."""
    problem = hypothesis.problem
    return turn(problem) - zero_change(hypothesis.values, problem.n)


def _resistance(row: Mapping[str, Entry], step: float, taken: float = 0.0,
                ) -> dict[str, str | float]:
    """Rotor, damping and dry friction of a drive."""
    found: dict[str, str | float] = {
        "armature": row["armature"].value - taken if "armature" in row else 0.0,
        "damping": _damping(row)}
    if row["frictionloss"].value:
        found |= {"frictionloss": row["frictionloss"].value,
                  "solreffriction": f"{4 * step:.9g} 1", "solimpfriction": "0.9999 0.9999 0.001"}
    return found


def _tendons(result: Result, rows: Sequence[Entry], step: float) -> Iterator[str]:
    """Motors that turn several joints: each a tendon, as long as the motor has turned."""
    hypothesis = result.model.hypothesis
    problem = hypothesis.problem
    coupling = problem.links.motor_coupling
    if coupling is None:
        return
    zero, tendons = _zeros(hypothesis), []
    for k, (shares, row) in enumerate(zip(inverse_of(coupling), _by_joint(rows).values())):
        found = {"name": problem.joints[k], **_resistance(row, step)}
        if row["stiffness"].value:
            found |= {"stiffness": row["stiffness"].value, "springlength": zero[k]}
        tendons.append(_element("fixed", found, [
            _element("joint", {"joint": name, "coef": share})
            for name, share in zip(problem.joints, shares) if share]))
    yield _comment("Motors turn several joints: each is a tendon over them, which has the name of "
                   "its joint; its length is the position of the motor over its gear ratio.")
    yield _element("tendon", {}, tendons)


def turn(problem: Problem) -> np.ndarray:
    """Position of the logs in which links point along the horizontal [rad], shape (n,).

    Zero, but for machines whose zero hangs down: the diagnosis has turned their positions.
    """
    if problem.statement is None or not problem.records:
        return np.zeros(problem.n)
    logged, used = problem.statement.records[0].q, problem.records[0].q
    return np.where(np.abs(logged[0] - used[0] - QUARTER_TURN) < 1e-6, QUARTER_TURN, 0.0)


def _damping(row: Mapping[str, Entry]) -> str:
    damping, drag = row["damping"].value, row["drag"].value
    return f"{damping:.9g} {drag:.9g}" if drag else f"{damping:.9g}"


def _motor(joint: str, row: Mapping[str, Entry], problem: Problem) -> str:
    at = "joint" if problem.links.motor_coupling is None else "tendon"
    found: dict[str, str | float] = {
        "name": joint, at: joint, "gear": row["gear"].value, "gainprm": row["gain"].value,
        "biastype": "affine", "biasprm": f"{row['offset'].value / row['gear'].value:.9g} 0 0"}
    if np.isfinite(row["limit"].value):
        limit = f"{row['limit'].value:.9g}"
        found["ctrlrange"] = f"-{limit} {limit}"
    if row["lag"].value:
        found |= {"dyntype": "filterexact", "dynprm": row["lag"].value}
    if row["delay"].value:
        found |= {"delay": row["delay"].value,
                  "nsample": math.ceil(row["delay"].value / LONGEST_STEP) + 1}
    return _element("general", found)


def _changes(result: Result, rows: Sequence[Entry]) -> str:
    """What to change in the user's simulator, joint by joint; it holds the rest already."""
    holder = "your simulator" if result.problem.simulated else "your loop"
    q, _ = _units(result.model.hypothesis.problem)
    parts = [
        _comment(f"Verdict: {result.verdict}. {_prediction(result, q)}"),
        _comment(f"Changes of {holder}, which holds the rest already; joint side but for gain, "
                 "limit and times. add: add the value to what your joint has. multiply: multiply "
                 "it by the value. replace: put the value in its place. An offset is a constant "
                 "torque on the joint that pushes forward where it is positive."),
        *_notes(result)]
    for joint, row in _by_joint(rows).items():
        changes = list(_changes_of(row))
        if changes:
            parts.append(_element("joint", {"name": joint}, changes))
    return _element("changes", {}, parts) + "\n"


def _changes_of(row: Mapping[str, Entry]) -> Iterator[str]:
    for name, entry in row.items():
        told = {"parameter": name, "unit": entry.unit, "mujoco": PLACES[name].mujoco}
        if name in ADDED and entry.change:
            yield _element("add", told | {"value": entry.change})
        if name == "gain" and entry.value != entry.before:
            yield _element("multiply", told | {"unit": "1", "value": entry.value / entry.before})
        if name == "limit" and entry.value != entry.before:
            yield _element("replace", told | {"value": entry.value})


def _element(name: str, attributes: Attributes, inside: Sequence[str] = ()) -> str:
    """An element of XML with its content indented."""
    shown = "".join(f" {key}={quoteattr(value if isinstance(value, str) else f'{value:.9g}')}"
                    for key, value in attributes.items())
    if not inside:
        return f"<{name}{shown}/>"
    lines = "\n".join(f"  {line}" for part in inside for line in part.splitlines())
    return f"<{name}{shown}>\n{lines}\n</{name}>"


def _comment(text: str) -> str:
    """A comment; two hyphens end one, and may stand in the name of a joint."""
    return "\n".join(textwrap.wrap(f"<!-- {text.replace('--', '- -')} -->", 95,
                                   subsequent_indent="     ", break_on_hyphens=False))
