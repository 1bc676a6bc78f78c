"""All methods on the logs of one robot, and what they agree on."""

import dataclasses

import numpy as np

from clie_blocks.analysis.identification.agreement import REFERENCE, disagreements
from clie_blocks.analysis.identification.clie import clie, composite
from clie_blocks.analysis.identification.closed_loop import closed_loop_least_squares, model_motion
from clie_blocks.analysis.identification.columns import BASE, known_load, term_names, terms
from clie_blocks.analysis.identification.motion import rough_inertia, split, whole
from clie_blocks.analysis.identification.prediction import predicted
from clie_blocks.analysis.identification.regression import (
    idim_least_squares,
    instrumental_variables,
    top_speed,
)
from clie_blocks.analysis.records.checks import check_record
from clie_blocks.analysis.records.repeatability import noise_floor
from clie_blocks.errors import ClieError, DivergedError, NotIdentifiableError, RecordError

__all__ = ["Identification", "identify"]


@dataclasses.dataclass(frozen=True, eq=False)
class Identification:
    """What a robot's logs say of its parameters.

    Parameters
    ----------
    robot : Robot
        The robot.
    sources : list of str
        Logs used.
    estimates : list of list of Estimate
        By joint, then by method.
    scale : ndarray, shape (n,)
        Factor from units of the command to physical ones: the stated torque gain, or 1.
    leftover : ndarray, shape (n,)
        Error of the fitted model in closed loop over the noise of the position: near 1 nothing
        is missing; NaN without a control law.
    disagreements : list of Disagreement
        Where methods differ beyond their intervals.
    predictions : list of Prediction
        Of the logs held out, by method.
    biases : list of Bias
        What the paper's three terms would be without the extra ones.
    warnings : list of str
        What the checks say of the logs used, and what could not be done.

    """

    robot: object
    sources: list
    estimates: list
    scale: np.ndarray
    leftover: np.ndarray
    disagreements: list
    predictions: list
    biases: list
    warnings: list


@dataclasses.dataclass(frozen=True)
class Bias:
    """Value of a term by the closed-loop least squares, with the extra terms and without."""

    joint: str
    term: str
    value: float
    without: float


def identify(records, held_out=(), extra=()):
    """Identify a robot from its logs.

    Parameters
    ----------
    records : list of Record
        Logs to learn from, with u and the robot; of one robot.
    held_out : list of Record
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
        If the motion does not show the parameters, or the logs lack the command.
    ClieError
        If an extra term is not known.

    """
    names = term_names(extra)
    records, warnings = _sound(records)
    robot = records[0].robot
    runs = split(records, rough_inertia(records[0]))
    loads = [known_load(run, robot) for run in runs]
    by_joint = [_one_joint(runs, loads, k, names, warnings) for k in range(robot.n)]
    if robot.controller.law != "unknown":
        _add_paper(by_joint, runs, loads, warnings)
    scale = robot.motor.torque_gain if robot.motor.torque_gain is not None else np.ones(robot.n)
    found = [d for k, joint in enumerate(by_joint)
             for d in disagreements(robot.joints[k], joint, float(scale[k]))]
    leftover = np.array([_leftover(runs, loads, k, joint) for k, joint in enumerate(by_joint)])
    return Identification(
        robot, [record.source for record in records], by_joint, scale, leftover, found,
        _predictions(by_joint, held_out),
        _biases(runs, loads, by_joint, scale) if extra else [], warnings)


def _sound(records):
    """Records without an error, and what the checks say; an error if none is left."""
    good, said, faults = [], [], []
    for record in records:
        fault, warnings = _judged(record)
        if fault is None:
            good.append(record)
            said += warnings
        else:
            faults.append(fault)
            said.append(f"Left out {fault}")
    if not good:
        raise faults[0]
    return good, said


def _judged(record):
    """What makes a record useless, as an error or None, and the warnings on it."""
    if record.robot is None or record.u is None:
        missing = "the command u" if record.u is None else "a robot.toml"
        return NotIdentifiableError(f"{record.source}: it comes without {missing}, and without it "
                                    "no parameter can be identified"), []
    found = check_record(record)
    errors = [f for f in found if f.severity == "error"]
    if errors:
        weak = all(f.check.startswith("excitation.") for f in errors)
        kind = NotIdentifiableError if weak else RecordError
        return kind(f"{record.source}: {errors[0]}"), []
    return None, [f"{record.source}: {f.joint + ': ' if f.joint else ''}{f.what}" for f in found
                  if f.severity == "warning"]


def _one_joint(runs, loads, k, names, warnings):
    """Estimates of one joint by the regressions; the best one first."""
    textbook = idim_least_squares(runs, loads, k, names)
    if runs[0].record.robot.controller.law == "unknown":
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


def _leftover(runs, loads, k, joint):
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


def _biases(runs, loads, by_joint, scale):
    """Change of the paper's three terms when the extra ones are left out."""
    found = []
    for k, joint in enumerate(by_joint):
        best = next((e for e in joint if e.method == REFERENCE), None)
        if best is None:
            continue
        try:
            plain = closed_loop_least_squares(runs, loads, k,
                                              idim_least_squares(runs, loads, k, BASE))
        except DivergedError:
            continue  # without the extra terms the model cannot follow the log at all
        found += [Bias(runs[0].record.joints[k], term, float(best.get(term)[0] * scale[k]),
                       float(plain.get(term)[0] * scale[k])) for term in BASE]
    return found


def _add_paper(by_joint, runs, loads, warnings):
    """Put CLIE and composite first; terms beyond their model are given to them as known."""
    known = [load + np.stack([_beyond(run, runs, k, joint[0]) for k, joint in enumerate(by_joint)],
                             axis=1) for run, load in zip(runs, loads, strict=True)]
    for method in (composite, clie):
        try:
            found = method(runs, known)
        except ClieError as error:
            warnings.append(f"{method.__name__} gives no result: {error}")
        else:
            for joint, estimate in zip(by_joint, found, strict=True):
                joint.insert(0, estimate)


def _beyond(run, runs, k, estimate):
    """Torque of the terms beyond the paper's three along a run."""
    columns = terms(estimate.names[3:], run.q[:, k], run.dq[:, k], run.ddq[:, k],
                    top_speed(runs, k))
    return columns @ estimate.value[3:]


def _predictions(by_joint, held_out):
    """Predictions of every log held out: by CLIE with what it was given, and by the reference."""
    found = []
    for record in held_out:
        run = whole(record, rough_inertia(record))
        load, noise = known_load(run, record.robot), noise_floor(record).std
        for method in ("CLIE (27)", REFERENCE):
            chosen = [_completed(joint, method) for joint in by_joint]
            if all(chosen):
                found.append(predicted(record, load, chosen, noise))
    return found


def _completed(joint, method):
    """Estimate of a method, with the terms that were given to it."""
    own = next((e for e in joint if e.method == method), None)
    reference = next((e for e in joint if e.method == REFERENCE), None)
    if own is None or reference is None:
        return None
    return dataclasses.replace(reference, method=method, value=np.concatenate(
        (own.value[:3], reference.value[3:])))
