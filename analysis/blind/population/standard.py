"""Trials of the study: robots with hidden effects, none, or parameters outside tolerance."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run, run_both
from clie_blocks.analysis.blind.engine.experiments import Experiment, draw_experiments
from clie_blocks.analysis.blind.engine.exporter import logged_command
from clie_blocks.analysis.blind.engine.robot import (
    DrawnRobot,
    draw_robot,
    draw_truth,
    restate_links,
)
from clie_blocks.analysis.blind.population.effect_site import HiddenEffect, Site
from clie_blocks.analysis.blind.population.effect_size import (
    FITTED,
    Reference,
    reference,
    relative_prediction_error,
    size_ratio,
)
from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS, STANDARD_NAMES
from clie_blocks.analysis.blind.population.maker import (
    Population,
    RejectedError,
    Run,
    Trial,
    leaves_set_point,
)
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.population.vocabulary import Vocabulary

SEVERITY = {"mild": 1.5, "medium": 4.0, "strong": 10.0}
FIRST, RUNGS, LADDERS = (1 / 8, 8.0), 5, 4  # sizes tried in parallel, and again elsewhere
STEEP = 1.5  # log of two neighbouring ratios that are too far apart to interpolate
OFF_TARGET = 0.25  # relative error of the ratio of a single effect that counts as another size
STILL = 0.02  # rad: a joint that moves less has not been excited
TRACE = 1.1  # relative to the noise floor: what is smaller has no size
CLIPPED = 0.5  # share of the time at the limit of a drive that nobody would accept
ABSORBED = ("torque_gain_error", "back_emf", "ratio_error",  # a refit absorbs them,
            "channel_skew", "sensor_gain")  # and these the motion never shows
ABSORBED_SIZE = {"mild": 2.0, "medium": 4.0, "strong": 8.0}
KINDS = (("single",) * 27 + ("pair",) * 5 + ("triple",) * 2 + ("none",) * 4
         + ("parametric",) * 4 + ("unknown",) * 8)
COUNT = {"pair": 2, "triple": 3}
MANY = "many"  # three effects or more, each with a size of its own
Truth = dict[str, np.ndarray]
Wrong = Callable[[np.random.Generator, DrawnRobot, Truth], Truth]
Motions = Callable[[np.random.Generator, DrawnRobot], list[Experiment]]
ONE_OF = (("coulomb", "stribeck", "asymmetric_coulomb"), ("joint_elasticity", "backlash"))


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    return draw_trial(rng, index, *plan(seed, index))


def draw_trial(rng: np.random.Generator, index: int, kind: str, names: tuple[str, ...],
               severity: str | Sequence[str] | None, robot_kind: str | None = None,
               noise_factor: float = 1.0, vocabulary: Vocabulary = STANDARD_NAMES,
               wrong: Wrong | None = None, motions: Motions = draw_experiments) -> Trial:
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
    severity : str, sequence of str or None
        Size of all, or of each, see `SEVERITY`.
    robot_kind : str, optional
        Kind of the robot; by default drawn, among those that the effects need.
    noise_factor : float, optional
        Noise of its encoders over what it is drawn with; all else stays the same.
    vocabulary : Vocabulary, optional
        What is made under each name.
    wrong : callable, optional
        ``wrong(rng, robot, truth)`` are the true parameters of a parametric trial; by default
        inertia and damping of one joint are beyond their tolerance.
    motions : callable, optional
        ``motions(rng, robot)`` are its experiments, three.

    Raises
    ------
    RejectedError
        If no laboratory would have logged that.

    """
    needs = next((vocabulary.needs[name] for name in names if name in vocabulary.needs), None)
    robot = draw_robot(rng, robot_kind) if needs is None else draw_robot(
        rng, str(rng.choice(needs[0])), *needs[1:])
    robot = vocabulary.mount_encoder(rng, robot, names)
    truth, experiments = draw_truth(rng, robot), motions(rng, robot)
    if kind == "parametric":
        truth = (wrong or _beyond_tolerance)(rng, robot, truth)
    noises = [robot.sigma * rng.standard_normal(one.q_d.shape) for one in experiments]
    ref = reference(robot, truth, experiments, noises)
    hidden = [vocabulary.draw(rng, name, Site(
        robot, truth, ref.runs[:len(FITTED)], vocabulary.joint(rng, name, robot.n)))
        for name in names]
    _check_healthy(experiments, ref.runs, hidden)
    check_drive(_with_effects(truth, hidden, [1.0] * len(hidden)))
    severities = [severity] * len(hidden) if isinstance(severity, str) else severity or ()
    sizes = [_size_for_ratio(robot, truth, experiments, noises, ref, one, own, index)
             for one, own in zip(hidden, severities)]
    affected = _with_effects(truth, hidden, [size for size, _ in sizes])
    soft = affected["half_gap"] + affected["twist_stiffness"] > 0
    if np.any((affected["late"] > 0) & soft):
        raise RejectedError("a delayed encoder behind a soft or loose gear")
    both = run_both(robot, [affected] * len(experiments), experiments, noises, seed=index)
    runs = [(q, u) for q, u, _ in both]
    _check_with_effects(experiments, runs, affected)
    label = _label(kind, hidden, sizes, severity, robot, experiments,
                   relative_prediction_error(robot, ref, runs))
    if kind == MANY:
        label["shares"] = _shares(robot, truth, hidden, [size for size, _ in sizes], experiments,
                                  noises, index)
    if hidden and label["ratio"] < TRACE and not set(names) & set(ABSORBED):
        raise RejectedError(f"{' and '.join(names)} leaves no trace")
    if noise_factor != 1.0:
        both = run_both(robot, [affected] * len(experiments), experiments,
                        [noise_factor * noise for noise in noises], seed=index)
    logs = [(q, logged_command(u, robot.period, affected)) for q, u, _ in both]
    return Trial(restate_links(robot, affected), experiments, logs, label,
                 [other for _, _, other in both] if robot.two_encoders else (), affected)


def _check_healthy(experiments: list[Experiment], runs: list[Run],
                    hidden: list[HiddenEffect]) -> None:
    if leaves_set_point(experiments, runs):
        raise RejectedError("the healthy robot is unstable")
    for one in hidden:
        for joint in one.joints:
            if max(np.ptp(q[:, joint - 1]) for q, _ in runs) < STILL:
                raise RejectedError(f"joint {joint} stands still")


def check_drive(truth: dict[str, np.ndarray]) -> None:
    """Refuse what the engine's motor with a winding does not have: no log would hold it."""
    has_winding = (truth["heating"] > 0) | (truth["back_emf"] > 0)
    more = ((truth["lag"] > 0) | (truth["delay"] > 0) | np.isfinite(truth["limit"])
            | (truth["gain"] != 1) | ((truth["heating"] > 0) & (truth["back_emf"] > 0)))
    if np.any(has_winding & more):
        raise RejectedError("a winding beside a lag, delay, limit or gain of the same drive")


def _check_with_effects(experiments: list[Experiment], runs: list[Run],
                      truth: dict[str, np.ndarray]) -> None:
    if leaves_set_point(experiments, runs):
        raise RejectedError("unstable or stuck with its effects")
    if max(np.max(np.mean(np.abs(u) >= truth["limit"], axis=0)) for _, u in runs) > CLIPPED:
        raise RejectedError("at the limit of its drive most of the time")


def _with_effects(truth: dict[str, np.ndarray], hidden: list[HiddenEffect],
                  sizes: list[float]) -> dict[str, np.ndarray]:
    """True parameters of the robot with all its effects."""
    combined = truth
    for one, size in zip(hidden, sizes):
        changed = one.apply(truth, size)
        combined = {key: np.where(changed[key] == truth[key], combined[key], changed[key])
                    for key in combined}
    return combined


def plan(seed: int, index: int) -> tuple[str, tuple[str, ...], str | None]:
    """Kind, names and severity of a trial, so that a study holds all of them in turn."""
    rng = np.random.default_rng([seed, 0, len(KINDS)])
    kinds = rng.permutation(KINDS)
    single, outside = rng.permutation(list(EFFECTS)), rng.permutation(list(OUTSIDERS))
    lap, position = divmod(index, len(kinds))
    kind = str(kinds[position])
    turn = lap * KINDS.count(kind) + int(np.sum(kinds[:position] == kind))
    if kind == "single":
        return kind, (str(single[turn % len(single)]),), size_in_turn(turn + turn // len(single))
    if kind == "unknown":
        return (kind, (str(outside[turn % len(outside)]),),
                size_in_turn(turn + turn // len(outside), 1))
    if kind in COUNT:
        return kind, _several(np.random.default_rng([seed, 1, turn]), COUNT[kind]), "medium"
    return kind, (), None


def size_in_turn(turn: int, least: int = 0) -> str:
    """Sizes in turn, from the least that is asked for."""
    sizes = list(SEVERITY)[least:]
    return sizes[turn % len(sizes)]


def _several(rng: np.random.Generator, count: int) -> tuple[str, ...]:
    """Effects that any robot may have at once."""
    free = [name for name in EFFECTS if name not in NEEDS]
    while True:
        names = tuple(map(str, rng.choice(free, count, replace=False)))
        if all(len(set(names) & set(group)) < 2 for group in ONE_OF):
            return names


def _beyond_tolerance(rng: np.random.Generator, robot: DrawnRobot, truth: Truth) -> Truth:
    """True parameters beyond the datasheet's tolerance at one joint."""
    k, changed = int(rng.integers(robot.n)), {key: truth[key].copy() for key in ("rotor", "drag")}
    changed["rotor"][k] *= 1 + rng.uniform(0.04, 0.15)
    changed["drag"][k] *= 1 + rng.uniform(0.4, 0.9)
    return {**truth, **changed}


def _size_for_ratio(robot: DrawnRobot, truth: dict[str, np.ndarray],
                    experiments: list[Experiment], noises: list[np.ndarray], ref: Reference,
                    hidden: HiddenEffect, severity: str, seed: int) -> tuple[float, bool]:
    """Size at which an effect has the wanted ratio to the noise floor, and whether it has."""
    if hidden.name in ABSORBED:
        return ABSORBED_SIZE[severity], False
    wanted = np.log(SEVERITY[severity] ** 2 - 1) / 2
    best = (-np.inf, 1.0)
    low, high = FIRST
    for _ in range(LADDERS):
        sizes = np.geomspace(low, high, RUNGS)
        traces = _traces(robot, [hidden.apply(truth, s) for s in sizes], experiments, noises, ref,
                         seed)
        best = max([best, *((t, s) for t, s in zip(traces, sizes) if t < wanted + STEEP)])
        above, diverged = _first(traces >= wanted), _first(np.isnan(traces))
        end = min(above, diverged)
        between = slice(end - 1, end + 1)
        if 0 < above < diverged and np.ptp(traces[between]) < STEEP:
            return float(np.exp(np.interp(wanted, traces[between], np.log(sizes[between])))), True
        if end == 0:
            low, high = low**2 / high, low
        elif end < RUNGS:
            low, high = sizes[between]
        else:
            low, high = high, high**2 / low
    return float(best[1]), False


def _first(flags: np.ndarray) -> int:
    """Position of the first flag that is set, or the number of flags."""
    return int(np.argmax(flags)) if np.any(flags) else len(flags)


def _traces(robot: DrawnRobot, lanes: list[dict[str, np.ndarray]], experiments: list[Experiment],
            noises: list[np.ndarray], ref: Reference, seed: int) -> np.ndarray:
    """Log of the trace beyond the noise floor, one per lane; NaN where a robot diverges."""
    logs = len(FITTED)
    all_runs = run(robot, [lane for lane in lanes for _ in FITTED],
                   experiments[:logs] * len(lanes), noises[:logs] * len(lanes), seed=seed)
    by_lane = [all_runs[logs * i:logs * (i + 1)] for i in range(len(lanes))]
    ratios = [np.nan if leaves_set_point(experiments, runs)
              else size_ratio(relative_prediction_error(robot, ref, runs)) for runs in by_lane]
    return np.log(np.maximum(np.square(ratios) - 1, 1e-8)) / 2


def _label(kind: str, hidden: list[HiddenEffect], sizes: list[tuple[float, bool]],
           severity: str | Sequence[str] | None, robot: DrawnRobot, experiments: list[Experiment],
           errors: np.ndarray) -> dict[str, Any]:
    """Truth of a trial, with its prediction errors relative to the noise floor, (logs, n)."""
    floor, ratio = robot.floor, size_ratio(errors)
    wanted = SEVERITY[severity] if isinstance(severity, str) else None
    off_target = (wanted is not None and len(hidden) == 1
                  and abs(ratio / wanted - 1) > OFF_TARGET)
    nominal = float(np.sqrt(np.sum((errors[2] * floor) ** 2)))
    least = float(np.sqrt(np.sum(floor**2)))
    return {
        "kind": kind, "labels": [one.name for one in hidden] or ["none"],
        "effects": [{"effect": one.name, "joints": list(one.joints), "size": size,
                     "numbers": _changes(one, size)} for one, (size, _) in zip(hidden, sizes)],
        "rescaled": [one.name for one, (_, reached) in zip(hidden, sizes)
                     if off_target or not reached],
        "severity": severity, "target_ratio": wanted, "ratio": ratio,
        "ratio_log3": errors[2].tolist(), "robot": f"{robot.kind} of {robot.n}",
        "gear_ratios": robot.ratio.tolist(), "gravity": robot.gravity, "period": robot.period,
        "discretisation": robot.discretisation,
        "excitations": [experiment.excitation for experiment in experiments],
        "seconds": [round(len(experiment.q_d) * robot.period, 3) for experiment in experiments],
        "gap": {"nominal": nominal, "true_model": least,
                "achievable_reduction": 1 - least / nominal}}


def _shares(robot: DrawnRobot, truth: dict[str, np.ndarray], hidden: list[HiddenEffect],
            sizes: list[float], experiments: list[Experiment], noises: list[np.ndarray],
            seed: int) -> dict[str, float]:
    """What each effect adds to the excess of the nominal model beside all others, of the whole.

    In all logs and with a refit within the tolerances of the robot file, as a diagnosis counts.
    """
    ref = reference(robot, truth, experiments, noises, within_tolerances=True)
    lanes = [_with_effects(truth, hidden, sizes),
             *(_with_effects(truth, hidden[:i] + hidden[i + 1:], sizes[:i] + sizes[i + 1:])
               for i in range(len(hidden)))]
    logs = len(experiments)
    all_runs = run(robot, [lane for lane in lanes for _ in experiments],
                   experiments * len(lanes), noises * len(lanes), seed=seed)
    if leaves_set_point(experiments * len(lanes), all_runs):
        raise RejectedError("unstable without one of its effects")
    whole, *without = (float(np.sum(relative_prediction_error(
        robot, ref, all_runs[logs * i:logs * (i + 1)])**2 - 1)) for i in range(len(lanes)))
    return {one.name: 1.0 - left / whole for one, left in zip(hidden, without)}


def _changes(hidden: HiddenEffect, size: float) -> dict[str, list[float]]:
    return {key: np.asarray(value).tolist() for key, value in hidden.change(size).items()}


STANDARD = Population(_draw)
