"""Which law of the library ran, at joints whose commands the stated law does not give.

Each law is a block, replayed on the logs with its free numbers fitted; one that ran leaves the
rounding of the commands.  Of those that do, one with fewer numbers is likelier.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.block_refit import (
    error_of,
    fitted,
    free_parameters,
    rms_left,
    with_parameters_that_ran,
    with_rounded_reference,
)
from clie_blocks.analysis.gap.controller.found_law import FoundLaw
from clie_blocks.analysis.gap.controller.library import (
    NEUTRAL,
    Variant,
    as_base,
    held_numbers,
    statement,
    tiers,
    units_of,
    with_numbers,
)
from clie_blocks.analysis.gap.controller.refit import with_law_states
from clie_blocks.analysis.gap.controller.replay import LawParameter
from clie_blocks.analysis.gap.problem.block_of_file import as_law, block_of_file, law_of_file
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.stated_law import pose_of
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import ClieError

LONGEST = 40.0  # s, after which no further law is tried
PIECE = 1500  # samples of a log, which refute most laws
LAX = 3.0  # times what rounding leaves, above which a piece refutes a law
SAMPLES = 200.0  # that count as independent where two laws leave rounding only
WORTH = np.log(SAMPLES) / 2  # of a number of a law, in nepers
ATTEMPTS = 12  # evaluations of a fit to a piece
FARTHEST = 4.0  # by which a controller's own model of the robot may be off
TRIED = 0.01  # of the probability, from which a law is told


@dataclasses.dataclass(frozen=True, eq=False)
class Trial:
    """A law of the library with the numbers that leave least of the commands.

    Parameters
    ----------
    variant : Variant
        The law.
    controller : Controller
        With the numbers that were found.
    law : BlockLaw
        The same as a block.
    parameters : tuple of LawParameter
        Numbers that are not the neutral or the stated ones.
    left, limit : ndarray, shape (n,)
        RMS that it leaves of the commands, and what rounding explains [N m].

    """

    variant: Variant
    controller: Controller
    law: BlockLaw
    parameters: tuple[LawParameter, ...]
    left: np.ndarray
    limit: np.ndarray

    def explains(self, k: int) -> bool:
        """Whether it leaves no more than rounding at a joint."""
        return bool(self.left[k] <= self.limit[k])

    def cost(self, k: int) -> float:
        """What its numbers at a joint cost, and how much more than rounding it leaves."""
        numbers = sum(one.joint in (k, None) for one in self.parameters)
        return WORTH * (numbers + self.variant.choices) + SAMPLES * float(
            np.log(max(self.left[k] / self.limit[k], 0.1)))


@dataclasses.dataclass(frozen=True, eq=False)
class Competition:
    """What the competition of laws found.

    Parameters
    ----------
    law : BlockLaw or None
        The law that ran, each joint under its own; None where none of the library did.
    found : tuple of FoundLaw
        One per joint of which it gives the commands.
    error, limit : ndarray, shape (n,)
        RMS that it leaves, and what rounding explains [N m].
    nearest : tuple of (int, str, float)
        Joints of no law, with the law that leaves least, and the share of the command it leaves.

    """

    law: BlockLaw | None
    found: tuple[FoundLaw, ...]
    error: np.ndarray
    limit: np.ndarray
    nearest: tuple[tuple[int, str, float], ...]


def compete(problem: Problem, stated: Controller, limit: np.ndarray,
            joints: Sequence[int], file: Controller | None = None) -> Competition:
    """Find the laws of the library that give the commands of some joints.

    Parameters
    ----------
    problem : Problem
        With logs as the law sees them.
    stated : Controller
        The law to start from; what it states of other joints stays.
    limit : ndarray, shape (n,)
        Largest RMS that rounding of the commands explains [N m].
    joints : sequence of int
        Joints whose commands the stated law does not give.
    file : Controller, optional
        What the robot file says, where the law to start from is another one.

    """
    base, left = as_base(stated, problem), set(joints)
    trials: list[Trial] = []
    piece, end = _piece(problem), time.monotonic() + LONGEST
    for tier in tiers(base, problem):
        if not left:
            break
        for variant in tier:
            if time.monotonic() > end:
                break
            trial = _tried(variant, problem, piece, limit, joints)
            if trial is not None:
                trials.append(trial)
        left -= {k for k in left for trial in trials if trial.explains(k)}
    chosen = {k: _ranked(trials, k) for k in joints}
    explained = [k for k in joints if chosen[k]]
    size = np.sqrt(np.mean(np.concatenate([log.u for log in problem.logs]) ** 2, axis=0))
    nearest = tuple((k, _title(best, k), float(best.left[k] / max(size[k], 1e-300)))
                    for k in joints if not chosen[k] and trials
                    for best in [min(trials, key=lambda trial: trial.left[k])])
    if not explained:
        return Competition(None, (), limit + np.inf, limit, nearest)
    law, of_joint = _joined(problem, stated, chosen, explained)
    return Competition(law, tuple(
        _found(chosen[k], k, file or stated) for k in explained),
                       error_of(problem, law), of_joint, nearest)


def _tried(variant: Variant, problem: Problem, piece: Problem, limit: np.ndarray,
           joints: Sequence[int]) -> Trial | None:
    """Law with its best numbers; None where a piece of a log refutes it, or it has no such law."""
    try:
        law = _law(problem, variant.controller)
        start = law if variant.start is None else _law(problem, variant.start)
        part = with_law_states(piece, start) if start.block.has_clock else piece
        held = held_numbers(variant.controller, {key for key, _ in law.block.parameters})
        free = free_parameters(problem, law, joints, held)
        first = start
        if variant.start is None:
            first, _ = fitted(part, start, limit, free, ATTEMPTS)
            left = rms_left(part, first)
            bound = with_rounded_reference(problem, first, limit)
            if np.all(left[list(joints)] > LAX * bound[list(joints)]):
                return Trial(variant, variant.controller, first, (), left, bound)
        ran, changed = with_parameters_that_ran(with_law_states(problem, first), first, limit,
                                                joints, law.parameters, held)
        controller = _numbered(variant.controller, ran)
    except (ClieError, np.linalg.LinAlgError):
        return None
    if not _is_credible(controller):
        return None
    return Trial(variant, controller, ran, changed, error_of(problem, ran),
                 with_rounded_reference(problem, ran, limit))


def _is_credible(controller: Controller) -> bool:
    """Whether a model within a law is not off by more than anyone would leave it."""
    shares = np.concatenate([np.ravel(x) for x in (controller.model_shares or {}).values()]
                            or [np.ones(1)])
    return bool(np.all((shares >= 1.0 / FARTHEST) & (shares <= FARTHEST)))


def _law(problem: Problem, controller: Controller) -> BlockLaw:
    robot = _robot(problem)
    return law_of_file(dataclasses.replace(robot, controller=controller), problem.period,
                       pose_of(robot, problem.records[0]), problem.links, problem.gear_ratio)


def _robot(problem: Problem) -> Robot:
    if problem.robot is None:
        raise TypeError("a user's loop has no robot file whose law could be another one")
    return problem.robot


def _numbered(controller: Controller, law: BlockLaw) -> Controller:
    """Controller with the numbers of its block."""
    values: dict[str, np.ndarray] = {}
    for (key, place), value in zip(law.block.parameters, law.parameters):
        values.setdefault(key, np.zeros(law.block.n))[place] = value
    return with_numbers(controller, values)


def _ranked(trials: Sequence[Trial], k: int) -> list[tuple[Trial, float]]:
    """Laws that give the commands of a joint, with probabilities, the likeliest first."""
    able = [trial for trial in trials if trial.explains(k)]
    if not able:
        return []
    cost = np.array([trial.cost(k) for trial in able])
    weight = np.exp(cost.min() - cost)
    order = np.argsort(cost)
    return [(able[j], float(weight[j] / weight.sum())) for j in order]


def _joined(problem: Problem, stated: Controller,
            chosen: dict[int, list[tuple[Trial, float]]],
            explained: Sequence[int]) -> tuple[BlockLaw, np.ndarray]:
    """Law of the robot: at each joint the likeliest, elsewhere the stated one; and its limits."""
    from clie_blocks.controllers import laws_side_by_side

    best = {k: chosen[k][0][0] for k in explained}
    limit = np.max([trial.limit for trial in best.values()], axis=0)
    lead = best[explained[0]]
    if all(trial is lead for trial in best.values()):
        return lead.law, limit
    robot = _robot(problem)
    controllers = [trial.controller for trial in dict.fromkeys(best.values())]
    order = list(dict.fromkeys(best.values()))
    blocks = [block_of_file(dataclasses.replace(robot, controller=one), problem.period,
                            problem.links, problem.gear_ratio) for one in controllers]
    choice = [order.index(best[k]) if k in best else 0 for k in range(problem.n)]
    joined = dataclasses.replace(robot, controller=dataclasses.replace(
        stated, saturation=_saturation(controllers)))
    return as_law(laws_side_by_side(blocks, choice), joined, problem.period,
                  pose_of(robot, problem.records[0])), limit


def _saturation(controllers: Sequence[Controller]) -> np.ndarray | None:
    return next((one.saturation for one in controllers if one.saturation is not None), None)


def _found(ranked: Sequence[tuple[Trial, float]], k: int, stated: Controller) -> FoundLaw:
    best, _ = ranked[0]
    same: dict[str, float] = {}
    for trial, probability in ranked:
        title = _title(trial, k)
        same[title] = same.get(title, 0.0) + probability
    name = _title(best, k)
    others = tuple((title, p) for title, p in same.items() if title != name and p >= TRIED)
    return FoundLaw(k, name, same[name], _numbers(best, k), others,
                    statement(best.controller, stated))


def _numbers(trial: Trial, k: int) -> dict[str, tuple[float, float, str]]:
    """Numbers of the law at a joint that matter: gains, and what is not neutral."""
    half = {(one.name, one.joint): one.half for one in trial.parameters}
    units = units_of(trial.controller)
    return {key: (float(value), half.get((key, k), 0.0), units.get(key, "1"))
            for (key, place), value in zip(trial.law.block.parameters, trial.law.parameters)
            if place == k and _matters(trial, key, k, float(value))}


def _matters(trial: Trial, key: str, k: int, value: float) -> bool:
    if key == "feedforward_width":
        return bool(_value(trial, "feedforward_coulomb", k))
    return value != NEUTRAL.get(key, 0.0)


def _value(trial: Trial, key: str, k: int) -> float:
    return next((float(value) for (name, place), value in zip(
        trial.law.block.parameters, trial.law.parameters) if (name, place) == (key, k)), 0.0)


def _title(trial: Trial, k: int) -> str:
    """The law in words."""
    controller = trial.controller
    has_integral = bool(_value(trial, "ki", k))
    form = {"pid": "PID" if has_integral else "PD",
            "cascade": "a cascade" if has_integral else "a cascade without integral"}.get(
                controller.law, controller.law)
    fed = [word for word in ("velocity", "acceleration") if _value(
        trial, f"feedforward_{word}", k)]
    if _value(trial, "feedforward_coulomb", k):
        fed.append("friction")
    parts = [] if not fed or controller.compensation == "computed_torque" else [
        f"feedforward of {' and '.join(fed)}"]
    words = trial.variant.name
    if not words.startswith("feedforward"):
        parts.insert(0, words.removesuffix(" and feedforward"))
    elif "winds up" in words:
        parts.append("an integral that winds up")
    if controller.saturation is not None and controller.saturation[k] < 1e9:
        parts.append(f"a limit of {controller.saturation[k]:.4g} N m")
    parts = [part for part in parts if part]
    return form + (f" with {', '.join(parts)}" if parts else "")


def _piece(problem: Problem) -> Problem:
    """Problem of one part of one log, that in which the commands move most."""
    def energy(log: Log) -> np.ndarray:
        moved = (log.u - log.u.mean(axis=0)) / np.maximum(log.u.std(axis=0), 1e-300)
        return np.convolve((moved**2).sum(axis=1), np.ones(min(PIECE, len(log))), "valid")

    log = problem.fit[0]
    first = int(np.argmax(energy(log)))
    rows = slice(first, first + PIECE)
    part = dataclasses.replace(
        log, at_rest=False, law_state=None, start=log.q[rows][0], **{
            name: value[rows] for name in ("q", "u", "q_d", "pe", "dither", "measured", "other_q",
                                         "supply")
            if (value := getattr(log, name)) is not None},
        added=log.added[rows] if isinstance(log.added, np.ndarray) else log.added)
    return dataclasses.replace(problem, fit=(part,), held_out=())
