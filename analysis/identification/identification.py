"""All methods on the logs of one robot, and what they agree on."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.analysis.identification.agreement import REFERENCE, Disagreement, disagreements
from clie_blocks.analysis.identification.clie import LastPass, clie, composite
from clie_blocks.analysis.identification.closed_loop import closed_loop_least_squares, model_motion
from clie_blocks.analysis.identification.columns import BASE, known_load, term_names, terms
from clie_blocks.analysis.identification.motion import Run, rough_inertia, split, whole
from clie_blocks.analysis.identification.prediction import Prediction, predict_log
from clie_blocks.analysis.identification.regression import (
    Estimate,
    idim_least_squares,
    instrumental_variables,
    top_speed,
)
from clie_blocks.analysis.identification.signals_of_log import command, robot_of
from clie_blocks.analysis.records.checks import check_record
from clie_blocks.analysis.records.command_unit import force_per_command
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.repeatability import noise_floor
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import ClieError, DivergedError, NotIdentifiableError, RecordError

__all__ = ["Identification", "identify"]


@dataclasses.dataclass(frozen=True, eq=False)
class Identification:
    """The parameters of a robot, by every method that its logs allow.

    Parameters
    ----------
    robot : Robot
        The robot.
    sources : list of str
        Logs used.
    estimates : list of list of Estimate
        By joint, then by method.
    scale : ndarray, shape (n,)
        Torque [N m] or force [N] per unit of command, as far as the robot file says; else 1.
    units : dict
        Units of position ``q``, command ``u``, and ``force``: of the command times its scale.
    error_over_noise : ndarray, shape (n,)
        Error of the fitted model in closed loop over the noise of the position: near 1 nothing
        is missing; NaN without a control law.
    disagreements : list of Disagreement
        Where methods differ beyond their intervals.
    predictions : list of Prediction
        Of the logs held out, by method.
    biases : list of Bias
        What the paper's three terms would be without the extra ones.
    last_pass : LastPass or None
        How CLIE converged; None where it gave no result.
    warnings : list of str
        Warnings of the checks on the logs used, and what could not be done.

    """

    robot: Robot
    sources: list[str]
    estimates: list[list[Estimate]]
    scale: np.ndarray
    units: Mapping[str, str]
    error_over_noise: np.ndarray
    disagreements: list[Disagreement]
    predictions: list[Prediction]
    biases: list["Bias"]
    last_pass: LastPass | None
    warnings: list[str]


@dataclasses.dataclass(frozen=True)
class Bias:
    """Value of a term by the closed-loop least squares, with the extra terms and without."""

    joint: str
    term: str
    value: float
    without: float


def identify(records: Sequence[Record], held_out: Sequence[Record] = (),
             extra: Sequence[str] = ()) -> Identification:
    """Identify a robot from its logs.

    Parameters
    ----------
    records : sequence of Record
        Logs to identify from, with u and the robot; of one robot.
    held_out : sequence of Record
        Logs to predict.
    extra : sequence of str
        Terms beyond the paper's three, such as ``coulomb``; see `columns.EXTRA`.

    Returns
    -------
    Identification
        All methods that the logs allow.

    Raises
    ------
    RecordError
        If a check finds an error in a log.
    NotIdentifiableError
        If the motion does not show the parameters, or the command is missing in the logs.
    ClieError
        If an extra term is not known.

    """
    names = term_names(extra)
    sound, warnings = _sound(records)
    robot = robot_of(sound[0])
    runs = split(sound, rough_inertia(sound[0]))
    loads = [known_load(run, robot) for run in runs]
    by_joint = [_one_joint(runs, loads, k, names, warnings) for k in range(robot.n)]
    known = robot.controller.law != "unknown"
    last_pass = _add_paper(by_joint, runs, loads, warnings) if known else None
    scale, units = _scale(sound[0].replace(robot=robot))
    return Identification(
        robot, [record.source for record in sound], by_joint, scale, units,
        np.array([_error_over_noise(runs, loads, k, joint) for k, joint in enumerate(by_joint)]),
        [difference for k, joint in enumerate(by_joint)
         for difference in disagreements(robot.joints[k], joint, float(scale[k]))],
        _predictions(by_joint, held_out),
        _biases(runs, loads, by_joint, scale) if extra else [], last_pass, warnings)


def _sound(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Records without an error, and the warnings on them; an error if none is left."""
    good, warnings, faults = [], [], []
    for record in records:
        fault, own = _examine(record)
        if fault is None:
            good.append(record)
            warnings += own
        else:
            faults.append(fault)
            warnings.append(f"Left out {fault}")
    if not good:
        raise faults[0]
    return good, warnings


def _examine(record: Record) -> tuple[ClieError | None, list[str]]:
    """What makes a record useless, as an error or None, and the warnings on it."""
    try:
        robot_of(record), command(record)
    except NotIdentifiableError as error:
        return error, []
    findings = check_record(record)
    errors = [f for f in findings if f.severity == "error"]
    if errors:
        weak = all(f.check.startswith("excitation.") for f in errors)
        kind = NotIdentifiableError if weak else RecordError
        return kind(f"{record.source}: {errors[0]}"), []
    return None, [f"{record.source}: {f.joint + ': ' if f.joint else ''}{f.what}" for f in findings
                  if f.severity == "warning"]


def _one_joint(runs: list[Run], loads: list[np.ndarray], k: int, names: tuple[str, ...],
               warnings: list[str]) -> list[Estimate]:
    """Estimates of one joint by the regressions; the best one first."""
    textbook = idim_least_squares(runs, loads, k, names)
    if robot_of(runs[0].record).controller.law == "unknown":
        warnings.append("The control law is not stated: only IDIM-LS is possible, which noise "
                        "biases.")
        return [textbook]
    try:
        loop = closed_loop_least_squares(runs, loads, k, textbook)
    except DivergedError as error:
        warnings.append(f"closed-loop LS gives no result: {error}")
        return [textbook]
    speed = top_speed(runs, k)
    motions = [model_motion(run, load, k, names, loop.value, speed)[:3]
               for run, load in zip(runs, loads, strict=True)]
    return [loop, instrumental_variables(runs, loads, k, names, motions), textbook]


def _error_over_noise(runs: list[Run], loads: list[np.ndarray], k: int,
                      joint: list[Estimate]) -> float:
    """Closed-loop error of the fit over the noise of the position: 1 when nothing is missing."""
    best = next((e for e in joint if e.method == REFERENCE), None)
    if best is None:
        return np.nan
    speed = top_speed(runs, k)
    errors, noise = [], []
    for run, load in zip(runs, loads, strict=True):
        q, _, _, loop = model_motion(run, load, k, best.names, best.value, speed)
        floor = noise_floor(run.record)
        errors.append((run.record.q[:, k] - q)[run.inner])
        noise.append(floor.std[k] * (loop.noise_gain() if floor.repeats == 0 else 1.0))
    error = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    return float(error / np.mean(noise)) if np.mean(noise) > 0 else np.nan


def _scale(record: Record) -> tuple[np.ndarray, dict[str, str]]:
    """Torque or force per unit of command, and the units of position, command and both."""
    units = {name: str(record.units[name][0]) for name in ("q", "u")}
    force = force_per_command(record)
    if force is None:
        return np.ones(record.n), units | {"force": units["u"]}
    return force, units | {"force": "N" if units["q"] == "m" else "N m"}


def _biases(runs: list[Run], loads: list[np.ndarray], by_joint: list[list[Estimate]],
            scale: np.ndarray) -> list[Bias]:
    """Change of the paper's three terms when the extra ones are left out."""
    biases = []
    for k, joint in enumerate(by_joint):
        best = next((e for e in joint if e.method == REFERENCE), None)
        if best is None:
            continue
        try:
            plain = closed_loop_least_squares(runs, loads, k,
                                              idim_least_squares(runs, loads, k, BASE))
        except DivergedError:
            continue  # without the extra terms the model cannot follow the log at all
        biases += [Bias(runs[0].record.joints[k], term, float(best.get(term)[0] * scale[k]),
                        float(plain.get(term)[0] * scale[k])) for term in BASE]
    return biases


def _add_paper(by_joint: list[list[Estimate]], runs: list[Run], loads: list[np.ndarray],
               warnings: list[str]) -> LastPass | None:
    """Put CLIE and composite first; terms beyond their model count as known to them.

    Returns the last pass of CLIE.
    """
    last_pass = None
    known = [load + np.stack([_beyond(run, runs, k, joint[0]) for k, joint in enumerate(by_joint)],
                             axis=1) for run, load in zip(runs, loads, strict=True)]
    for method in (composite, clie):
        try:
            estimates, last = method(runs, known)
        except ClieError as error:
            warnings.append(f"{method.__name__} gives no result: {error}")
        else:
            for joint, estimate in zip(by_joint, estimates, strict=True):
                joint.insert(0, estimate)
            last_pass = last if method is clie else None
    return last_pass


def _beyond(run: Run, runs: list[Run], k: int, estimate: Estimate) -> np.ndarray:
    """Torque of the terms beyond the paper's three along a run."""
    columns = terms(estimate.names[3:], run.q[:, k], run.dq[:, k], run.ddq[:, k],
                    top_speed(runs, k))
    return columns @ estimate.value[3:]


def _predictions(by_joint: list[list[Estimate]], held_out: Sequence[Record]) -> list[Prediction]:
    """Predictions of every log held out: by CLIE with its known terms, and by the reference."""
    predictions = []
    for record in held_out:
        run = whole(record, rough_inertia(record))
        load, noise = known_load(run, robot_of(record)), noise_floor(record).std
        for method in ("CLIE (27)", REFERENCE):
            completed = [_complete(joint, method) for joint in by_joint]
            estimates = [estimate for estimate in completed if estimate is not None]
            if len(estimates) == len(by_joint):
                predictions.append(predict_log(record, load, estimates, noise))
    return predictions


def _complete(joint: list[Estimate], method: str) -> Estimate | None:
    """Estimate of a method, with the terms that were known to it."""
    own = next((e for e in joint if e.method == method), None)
    reference = next((e for e in joint if e.method == REFERENCE), None)
    if own is None or reference is None:
        return None
    return dataclasses.replace(reference, method=method, value=np.concatenate(
        (own.value[:3], reference.value[3:])))
