"""Trials of the study: robots with hidden effects, or none, or numbers beyond the datasheet."""

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import draw_motions
from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth, restated
from clie_blocks.analysis.blind.population.effect_size import (
    FITTED,
    prediction,
    ratio_of,
    reference,
)
from clie_blocks.analysis.blind.population.effects import (
    EFFECTS,
    NEEDS,
    OUTSIDERS,
    Scene,
    draw_hidden,
)
from clie_blocks.analysis.blind.population.maker import Family, RejectedError, Trial, lost

SEVERITY = {"mild": 1.5, "medium": 4.0, "strong": 10.0}
FIRST, RUNGS, LADDERS = (1 / 8, 8.0), 5, 4  # sizes tried side by side, and again elsewhere
STEEP = 1.5  # log of two neighbouring ratios that are too far apart to go between
MISSED = 0.25  # relative error of the ratio of a single effect that counts as another size
STILL = 0.02  # rad: a joint that moves less has not been excited
TRACE = 1.1  # relative to the noise floor: what is smaller has no size
CLIPPED = 0.5  # share of the time at the limit of a drive that nobody would accept
UNSEEN = {  # effects that a refit absorbs: sizes that its numbers show instead
    "torque_gain_error": {"mild": 2.0, "medium": 4.0, "strong": 8.0}}
KINDS = (("single",) * 27 + ("pair",) * 5 + ("triple",) * 2 + ("none",) * 4
         + ("parametric",) * 4 + ("unknown",) * 8)
COUNT = {"pair": 2, "triple": 3}
ONE_OF = (("coulomb", "stribeck", "asymmetric_coulomb"), ("joint_elasticity", "backlash"))


def _draw(rng, seed, index):
    return afflicted(rng, index, *plan(seed, index))


def afflicted(rng, index, kind, names, severity, robot_kind=None):
    """Draw a robot, give it effects, and log it.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    index : int
        Number of the trial, which seeds what is random in its drives.
    kind : str
        Of the trial, see `KINDS`.
    names : tuple of str
        Its effects.
    severity : str or None
        Size of each, see `SEVERITY`.
    robot_kind : str, optional
        Kind of the robot; by default drawn, among those that the effects need.

    Raises
    ------
    RejectedError
        If no laboratory would have logged that.

    """
    needs = next((NEEDS[name] for name in names if name in NEEDS), None)
    robot = draw_robot(rng, robot_kind) if needs is None else draw_robot(
        rng, str(rng.choice(needs[0])), *needs[1:])
    truth, motions = draw_truth(rng, robot), draw_motions(rng, robot)
    if kind == "parametric":
        truth = _beyond(rng, robot, truth)
    noises = [robot.sigma * rng.standard_normal(motion.q_d.shape) for motion in motions]
    ref = reference(robot, truth, motions, noises)
    hidden = [draw_hidden(rng, name, Scene(robot, truth, ref.runs[:len(FITTED)],
                                           int(rng.integers(robot.n)))) for name in names]
    _accept_healthy(motions, ref.runs, hidden)
    found = [_sized(robot, truth, motions, noises, ref, one, severity, index)
             for one in hidden]
    numbers = _numbers(truth, hidden, [size for size, _ in found])
    if np.any((numbers["late"] > 0) & (numbers["half_gap"] + numbers["twist_stiffness"] > 0)):
        raise RejectedError("a late encoder behind a gear that gives way")
    runs = run(robot, [numbers] * len(motions), motions, noises, seed=index)
    _accept_afflicted(motions, runs, numbers)
    label = _label(kind, hidden, found, severity, robot, motions, prediction(robot, ref, runs))
    if hidden and label["ratio"] < TRACE and not set(names) & set(UNSEEN):
        raise RejectedError(f"{' and '.join(names)} leaves no trace")
    return Trial(restated(robot, numbers), motions, runs, label)


def _accept_healthy(motions, runs, hidden):
    if lost(motions, runs):
        raise RejectedError("the healthy robot is unstable")
    for one in hidden:
        for joint in one.joints:
            if max(np.ptp(q[:, joint - 1]) for q, _ in runs) < STILL:
                raise RejectedError(f"joint {joint} stands still")


def _accept_afflicted(motions, runs, numbers):
    if lost(motions, runs):
        raise RejectedError("unstable or stuck with its effects")
    if max(np.max(np.mean(np.abs(u) >= numbers["limit"], axis=0)) for _, u in runs) > CLIPPED:
        raise RejectedError("at the limit of its drive most of the time")


def _numbers(truth, hidden, sizes):
    """True numbers of the robot with all its effects."""
    numbers = truth
    for one, size in zip(hidden, sizes):
        changed = one.onto(truth, size)
        numbers = {key: np.where(changed[key] == truth[key], numbers[key], changed[key])
                   for key in numbers}
    return numbers


def plan(seed, index):
    """Kind, names and severity of a trial, so that a study holds all of them in turn."""
    order = np.random.default_rng([seed, 0, len(KINDS)])
    kinds = order.permutation(KINDS)
    single, outside = order.permutation(list(EFFECTS)), order.permutation(list(OUTSIDERS))
    lap, place = divmod(index, len(kinds))
    kind = str(kinds[place])
    turn = lap * KINDS.count(kind) + int(np.sum(kinds[:place] == kind))
    if kind == "single":
        return kind, (str(single[turn % len(single)]),), _severity(turn, len(single), 0)
    if kind == "unknown":
        return kind, (str(outside[turn % len(outside)]),), _severity(turn, len(outside), 1)
    if kind in COUNT:
        return kind, _several(np.random.default_rng([seed, 1, turn]), COUNT[kind]), "medium"
    return kind, (), None


def _severity(turn, lap, least):
    """Sizes in turn, shifted from lap to lap so that every effect meets all of them."""
    sizes = list(SEVERITY)[least:]
    return sizes[(turn + turn // lap) % len(sizes)]


def _several(rng, count):
    """Effects that any robot may have at once."""
    free = [name for name in EFFECTS if name not in NEEDS]
    while True:
        names = tuple(map(str, rng.choice(free, count, replace=False)))
        if all(len(set(names) & set(group)) < 2 for group in ONE_OF):
            return names


def _beyond(rng, robot, truth):
    """Numbers beyond the datasheet's tolerance at one joint."""
    k, found = int(rng.integers(robot.n)), {key: truth[key].copy() for key in ("rotor", "drag")}
    found["rotor"][k] *= 1 + rng.uniform(0.04, 0.15)
    found["drag"][k] *= 1 + rng.uniform(0.4, 0.9)
    return {**truth, **found}


def _sized(robot, truth, motions, noises, ref, hidden, severity, seed):
    """Size at which an effect has the wanted ratio to the noise floor, and whether it has."""
    if hidden.name in UNSEEN:
        return UNSEEN[hidden.name][severity], False
    wanted, best = np.log(SEVERITY[severity] ** 2 - 1) / 2, (-np.inf, 1.0)
    low, high = FIRST
    for _ in range(LADDERS):
        sizes = np.geomspace(low, high, RUNGS)
        traces = _traces(robot, [hidden.onto(truth, s) for s in sizes], motions, noises, ref,
                         seed)
        best = max([best, *((t, s) for t, s in zip(traces, sizes) if t < wanted + STEEP)])
        above, wild = _first(traces >= wanted), _first(np.isnan(traces))
        end = min(above, wild)
        between = slice(end - 1, end + 1)
        if 0 < above < wild and np.ptp(traces[between]) < STEEP:
            return float(np.exp(np.interp(wanted, traces[between], np.log(sizes[between])))), True
        if end == 0:
            low, high = low**2 / high, low
        elif end < RUNGS:
            low, high = sizes[between]
        else:
            low, high = high, high**2 / low
    return float(best[1]), False


def _first(flags):
    """Place of the first flag that is set, or their number."""
    return int(np.argmax(flags)) if np.any(flags) else len(flags)


def _traces(robot, lanes, motions, noises, ref, seed):
    """Log of the trace beyond the noise floor, of robots side by side; NaN where one is wild."""
    logs = len(FITTED)
    found = run(robot, [lane for lane in lanes for _ in FITTED], motions[:logs] * len(lanes),
                noises[:logs] * len(lanes), seed=seed)
    runs = [found[logs * i:logs * (i + 1)] for i in range(len(lanes))]
    ratios = [np.nan if lost(motions, one) else ratio_of(prediction(robot, ref, one))
              for one in runs]
    return np.log(np.maximum(np.square(ratios) - 1, 1e-8)) / 2


def _label(kind, hidden, found, severity, robot, motions, errors):
    floor, ratio, wanted = robot.floor, ratio_of(errors), SEVERITY.get(severity)
    missed = len(hidden) == 1 and abs(ratio / wanted - 1) > MISSED
    judged = float(np.sqrt(np.sum((errors[2] * floor) ** 2)))
    least = float(np.sqrt(np.sum(floor**2)))
    return {
        "kind": kind, "labels": [one.name for one in hidden] or ["none"],
        "effects": [{"effect": one.name, "joints": list(one.joints), "size": size,
                     "numbers": _changed(one, size)} for one, (size, _) in zip(hidden, found)],
        "rescaled": [one.name for one, (_, reached) in zip(hidden, found)
                     if missed or not reached],
        "severity": severity, "target_ratio": wanted, "ratio": ratio,
        "ratio_log3": errors[2].tolist(), "robot": f"{robot.kind} of {robot.n}",
        "gear_ratios": robot.ratio.tolist(), "gravity": robot.gravity, "period": robot.period,
        "discretisation": robot.discretisation,
        "excitations": [motion.excitation for motion in motions],
        "seconds": [round(len(motion.q_d) * robot.period, 3) for motion in motions],
        "gap": {"nominal": judged, "true_model": least,
                "achievable_reduction": 1 - least / judged}}


def _changed(hidden, size):
    return {key: np.asarray(value).tolist() for key, value in hidden.change(size).items()}


HIDDEN = Family(_draw)
