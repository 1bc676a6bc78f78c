"""One trial: a robot, three logs, and the label that stays sealed."""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.hidden import (
    EFFECTS,
    NEEDS,
    OUTSIDERS,
    Scene,
    draw_hidden,
)
from clie_blocks.analysis.blind.loop import run
from clie_blocks.analysis.blind.motion import draw_motions
from clie_blocks.analysis.blind.robot import draw_robot, draw_truth
from clie_blocks.analysis.blind.size import FITTED, prediction, ratio_of, reference

SEVERITY = {"mild": 1.5, "medium": 4.0, "strong": 10.0}
RUNGS = 8.0 ** np.linspace(-1, 1, 5)  # sizes tried side by side
LADDERS = 2
LOST = 2.0  # rad off the set-point: nobody would log a robot that does that
UNSEEN = {  # effects that a refit absorbs: sizes that its numbers show instead
    "torque_gain_error": {"mild": 2.0, "medium": 4.0, "strong": 8.0}}
KINDS = ("single",) * 11 + ("none",) * 2 + ("pair",) * 3 + ("unknown",) * 4
PARAMETRIC_SHARE = 0.4  # of the trials without an effect


@dataclass(frozen=True, eq=False)
class Trial:
    """What is written to the trial's folder, and its label.

    Parameters
    ----------
    robot : Robot
        As stated.
    motions : list of Motion
        The experiments.
    runs : list of (q, u)
        The logs.
    label : dict
        The truth.

    """

    robot: object
    motions: list
    runs: list
    label: dict


def make_trial(seed, index):
    """Make one trial.

    Parameters
    ----------
    seed : int
        Of the study.
    index : int
        Number of the trial; fixes kind, effects and size in turn, all else is drawn.

    Returns
    -------
    Trial
        The same for the same numbers.

    """
    rng = np.random.default_rng([seed, index])
    kind, names, severity = plan(seed, index)
    needs = [NEEDS[name] for name in names if name in NEEDS]
    robot = draw_robot(rng, str(rng.choice(needs[0][0])) if needs else None,
                       needs[0][1] if needs else None)
    truth, motions = draw_truth(rng, robot), draw_motions(rng, robot)
    noises = [robot.sigma * rng.standard_normal(motion.q_d.shape) for motion in motions]
    ref = reference(robot, truth, motions, noises)
    if kind == "parametric":
        truth = _beyond(rng, robot, truth)
    hidden = [draw_hidden(rng, name, Scene(robot, truth, ref.loudest,
                                           int(rng.integers(robot.n)))) for name in names]
    sizes = [_sized(robot, truth, motions, noises, ref, one, severity) for one in hidden]
    runs = _afflicted(robot, truth, motions, noises, hidden, sizes, index)
    while hidden and _lost(motions, runs):
        sizes = [size / 2 for size in sizes]
        runs = _afflicted(robot, truth, motions, noises, hidden, sizes, index)
    return Trial(robot, motions, runs, _label(
        kind, hidden, sizes, severity, robot, motions, prediction(robot, ref, runs)))


def _lost(motions, runs):
    return any(np.abs(q - motion.q_d).max() > LOST for motion, (q, _) in zip(motions, runs))


def _afflicted(robot, truth, motions, noises, hidden, sizes, seed):
    """Runs of the robot with all its effects."""
    numbers = truth
    for one, size in zip(hidden, sizes):
        changed = one.onto(truth, size)
        numbers = {key: np.where(changed[key] == truth[key], numbers[key], changed[key])
                   for key in numbers}
    return run(robot, [numbers] * len(motions), motions, noises, seed=seed)


def plan(seed, index):
    """Kind, names and severity of a trial, so that a study holds all of them in turn."""
    order = np.random.default_rng([seed, 0, len(KINDS)])
    kinds = order.permutation(KINDS)
    single, outside = order.permutation(list(EFFECTS)), order.permutation(list(OUTSIDERS))
    lap, place = divmod(index, len(kinds))
    kind = str(kinds[place])
    turn = lap * KINDS.count(kind) + int(np.sum(kinds[:place] == kind))
    severity = list(SEVERITY)[turn % 3]
    if kind == "single":
        return kind, (str(single[turn % len(single)]),), severity
    if kind == "unknown":
        return kind, (str(outside[turn % len(outside)]),), list(SEVERITY)[1 + turn % 2]
    if kind == "pair":
        return kind, _pair(np.random.default_rng([seed, 1, turn])), "medium"
    chance = np.random.default_rng([seed, 2, turn]).random()
    return ("parametric" if chance < PARAMETRIC_SHARE else "none"), (), None


def _pair(rng):
    free = [name for name in EFFECTS if name not in NEEDS]
    return tuple(map(str, rng.choice(free, 2, replace=False)))


def _beyond(rng, robot, truth):
    """Numbers beyond the datasheet's tolerance at one joint."""
    k, found = int(rng.integers(robot.n)), {key: truth[key].copy() for key in ("rotor", "drag")}
    found["rotor"][k] *= 1 + rng.uniform(0.04, 0.15)
    found["drag"][k] *= 1 + rng.uniform(0.4, 0.9)
    return {**truth, **found}


def _sized(robot, truth, motions, noises, ref, hidden, severity):
    """Size at which an effect has the wanted ratio to the noise floor, or the nearest found."""
    if hidden.name in UNSEEN:
        return UNSEEN[hidden.name][severity]
    wanted, centre = np.log(SEVERITY[severity] ** 2 - 1) / 2, 1.0
    for _ in range(LADDERS):
        sizes = centre * RUNGS
        traces = _traces(robot, [hidden.onto(truth, s) for s in sizes], motions, noises, ref)
        if wanted < traces[0]:
            centre = sizes[0]
        elif wanted > traces.max():
            centre = sizes[-1]
        else:
            above = int(np.argmax(traces >= wanted))
            part = slice(max(above - 1, 0), above + 1)
            return float(np.exp(np.interp(wanted, traces[part], np.log(sizes[part]))))
    return float(centre)


def _traces(robot, lanes, motions, noises, ref):
    """Log of the trace beyond the noise floor, of several robots side by side."""
    logs = len(FITTED)
    found = run(robot, [lane for lane in lanes for _ in FITTED], motions[:logs] * len(lanes),
                noises[:logs] * len(lanes))
    ratios = [ratio_of(prediction(robot, ref, found[logs * i:logs * (i + 1)]))
              for i in range(len(lanes))]
    return np.log(np.maximum(np.square(np.nan_to_num(ratios, nan=1e6)) - 1, 1e-8)) / 2


def _label(kind, hidden, sizes, severity, robot, motions, errors):
    floor = robot.floor
    judged = float(np.sqrt(np.sum((errors[2] * floor) ** 2)))
    least = float(np.sqrt(np.sum(floor**2)))
    return {
        "kind": kind, "labels": [one.name for one in hidden] or ["none"],
        "effects": [{"effect": one.name, "joints": list(one.joints), "size": size,
                     "numbers": _changed(one, size)} for one, size in zip(hidden, sizes)],
        "severity": severity, "target_ratio": SEVERITY.get(severity), "ratio": ratio_of(errors),
        "ratio_log3": errors[2].tolist(), "robot": f"{robot.kind} of {robot.n}",
        "period": robot.period, "excitations": [motion.excitation for motion in motions],
        "gap": {"nominal": judged, "true_model": least,
                "achievable_reduction": 1 - least / judged}}


def _changed(hidden, size):
    return {key: np.asarray(value).tolist() for key, value in hidden.change(size).items()}
