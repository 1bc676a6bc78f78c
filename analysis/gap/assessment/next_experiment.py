"""The run that best tells the remaining causes apart, as set-points that a robot can follow."""

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from clie_blocks.analysis.gap.assessment.test_motions import (
    Limits,
    elementary_motions,
    multisine_motion,
    scale_inside,
    trusted_limits,
)
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.jacobian import changes_of_motion
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import RATE, decimated, whiten
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.posterior import (
    NONE,
    SET_PROBABILITY,
    UNKNOWN,
    RankedCause,
)

_MENU = 8  # experiments that are reported
Odds = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Odds (unnormalised) from prior probabilities and chi^2 distances to the true model."""


@dataclasses.dataclass(frozen=True, eq=False)
class NextExperiment:
    """The recommended run.

    Parameters
    ----------
    separates : list of list of str
        Causes of the hypotheses that remain.
    menu : list of dict
        Each run with its least distance between two models [chi^2], and the expected size of the
        set after it.
    best : dict
        The recommended row of the menu.
    run : Log
        Its set-points.
    period : float
        Their sample time [s].

    """

    separates: list[list[str]]
    menu: list[dict[str, Any]]
    best: dict[str, Any]
    run: Log
    period: float

    def as_dict(self) -> dict[str, Any]:
        """Everything but the set-points, in plain types."""
        return {"separates": self.separates, "best": self.best, "menu": self.menu}

    def set_points(self, units: Mapping[str, Sequence[str]] | None = None) -> str:
        """The run as CSV text: time [s], then qd and pe of each joint.

        Units are in the header, as in logs, where they are not rad and N m.
        """
        rad, torque = (["rad"] * self.run.q_d.shape[1], ["N m"] * self.run.q_d.shape[1])
        stated = {"qd": rad, "pe": torque} if units is None else {
            "qd": units["q"], "pe": units["u"]}
        head = ["time", *(f"{name}{k + 1}{_in_header(unit)}" for name, of_joints in stated.items()
                          for k, unit in enumerate(of_joints))]
        time = self.period * np.arange(len(self.run))
        rows = np.column_stack([time, self.run.q_d, self.run.pe])
        return "\n".join([",".join(head), *(",".join(f"{x:.7g}" for x in row) for row in rows),
                          ""])


def _in_header(unit: str) -> str:
    """Unit in the name of a column, where it is not what a log has without one."""
    return "" if unit in ("rad", "N m") else f"[{unit}]"


class _Tried(NamedTuple):
    """An experiment inside the limits, what each model does in it, and what it would bring."""

    log: Log
    motions: list[np.ndarray]
    least_distance: float
    expected_set_size: float

    @property
    def cost(self) -> tuple[float, float]:
        """Order of experiments: few causes left, then much evidence."""
        return self.expected_set_size, -self.least_distance

    @property
    def row(self) -> dict[str, Any]:
        return {"experiment": self.log.name, "least_distance": self.least_distance,
                "expected_set_size": self.expected_set_size}


class _Remaining(NamedTuple):
    """A hypothesis of the credible set, the model that stands for it, and what it leaves."""

    ranked: RankedCause
    model: Fit
    excess: float


def next_experiment(residuals: ResidualModel, nominal: Fit, ranking: Sequence[RankedCause],
                    ) -> NextExperiment | None:
    """Return the experiment that separates the causes of the 90 % set.

    None if one hypothesis is left, if one of them is something unknown, of which no model says how
    far it moves the robot, if the stated limits leave no room beside what the logs reached, or if
    no experiment would leave fewer than there are.

    Elementary experiments and multisines, whose lines, phases and share of set-point and torque
    are searched, are simulated with each remaining model, none of which may leave the robot's
    limits, or ask for much more torque than the logs show; the whitened distance between two
    predictions is the evidence that the run would bring, and the verdict's own odds say how many
    causes it would leave.  Of the best of them only what no refit of the other model would follow
    is evidence.
    """
    method, problem = residuals.method.assessment, residuals.problem
    remaining = _remaining(ranking, nominal, method)
    if len(remaining) < 2:
        return None
    limits = trusted_limits(problem, method)
    if np.any(limits.lowest >= limits.highest):
        return None
    odds = _odds_after(residuals, nominal, remaining)

    def tried(log: Log) -> _Tried | None:
        return _simulated(residuals, remaining, limits, odds, log)

    elementary = (tried(log) for log in elementary_motions(problem, limits, method))
    experiments = [one for one in elementary if one is not None]
    experiments += _search_multisines(problem, limits, method, tried)
    present = _set_size(np.array([one.ranked.probability for one in remaining]))

    def gains(one: _Tried) -> bool:
        return one.expected_set_size < present - method.experiment_least_gain

    best = sorted(filter(gains, experiments), key=lambda one: one.cost)[:_MENU]
    refitted = (_after_refits(residuals, remaining, odds, one) for one in best)
    menu = sorted(filter(gains, refitted), key=lambda one: one.cost)
    if not menu:
        return None
    return NextExperiment([list(one.ranked.names) for one in remaining],
                          [one.row for one in menu], menu[0].row, menu[0].log, problem.period)


def _remaining(ranking: Sequence[RankedCause], nominal: Fit, method: AssessmentMethod,
               ) -> list[_Remaining]:
    """Hypotheses of the credible set, with the models that stand for them; none if one has none.

    That nothing is there has the nominal model.
    """
    remaining: list[_Remaining] = []
    held = 0.0
    for ranked in ranking:
        if held >= SET_PROBABILITY:
            break
        held += ranked.probability
        if UNKNOWN in ranked.names:
            return []
        if ranked.names == (NONE,):
            remaining.append(_Remaining(ranked, nominal, ranked.excess))
        elif ranked.fit is not None:
            remaining.append(_Remaining(ranked, ranked.fit, ranked.fit.excess))
    return remaining[:method.experiment_causes]


def _search_multisines(problem: Problem, limits: Limits, method: AssessmentMethod,
                       tried: Callable[[Log], _Tried | None]) -> list[_Tried]:
    """Multisines of each band, then variations of the best of them."""
    rng = np.random.default_rng(0)
    shape = (2, method.experiment_lines, problem.n)
    settings = [(band, rng.uniform(0, 2 * np.pi, shape), share)
                for band, share in itertools.product(method.experiment_bands,
                                                     method.experiment_reference_shares)]
    experiments = []
    for setting in settings:
        one = tried(multisine_motion(problem, limits, *setting, method))
        if one is not None:
            experiments.append((one, setting))
    for _ in range(method.experiment_tries):
        if not experiments:
            break
        band, phases, share = min(experiments, key=lambda pair: pair[0].cost)[1]
        setting = (band, phases + rng.normal(0, 1.0, phases.shape),
                   float(np.clip(share + rng.normal(0, 0.2), 0.0, 1.0)))
        one = tried(multisine_motion(problem, limits, *setting, method))
        if one is not None:
            experiments.append((one, setting))
    return [one for one, _ in experiments]


def _simulated(residuals: ResidualModel, remaining: Sequence[_Remaining], limits: Limits,
               odds: Odds, log: Log) -> _Tried | None:
    """Experiment inside the limits with what it would bring; None where there is none."""
    models = [one.model.hypothesis for one in remaining]
    scaled = scale_inside(models, log, limits, residuals.method.assessment.experiment_limit)
    if scaled is None:
        return None
    log, motions = scaled
    whitened = [_whitened(residuals, motion) for motion in motions]
    distances = _distances(len(remaining), lambda true, other: float(
        np.sum((whitened[true] - whitened[other]) ** 2)))
    return _weighed(log, motions, distances, remaining, odds)


def _after_refits(residuals: ResidualModel, remaining: Sequence[_Remaining], odds: Odds,
                  tried: _Tried) -> _Tried:
    """The same experiment, where each model is refitted to the motion of each other one.

    To first order, with what the old logs say of its parameters as prior information.
    """
    whitened = [_whitened(residuals, motion) for motion in tried.motions]
    roots = [_followed(residuals, one.model, tried.log) for one in remaining]

    def left(true: int, other: int) -> float:
        apart, root = whitened[true] - whitened[other], roots[other]
        seen = root.T @ apart
        return float(apart @ apart - seen @ np.linalg.solve(
            np.eye(len(seen)) + root.T @ root, seen))

    return _weighed(tried.log, tried.motions, _distances(len(remaining), left), remaining, odds)


def _followed(residuals: ResidualModel, model: Fit, log: Log) -> np.ndarray:
    """What the uncertain parameters of a model do to its motion: a root of the covariance."""
    columns = np.nan_to_num(np.stack([
        _whitened(residuals, change)
        for change in changes_of_motion(model.hypothesis, log, residuals)], axis=1))
    variances, directions = np.linalg.eigh(model.covariance)
    return np.asarray(columns @ (directions * np.sqrt(np.maximum(variances, 0.0))))


def _distances(count: int, distance: Callable[[int, int], float]) -> np.ndarray:
    """Distance of each model from the motion of the one that is true, shape (true, other)."""
    apart = np.zeros((count, count))
    for true, other in itertools.permutations(range(count), 2):
        apart[true, other] = distance(true, other)
    return apart


def _weighed(log: Log, motions: list[np.ndarray], apart: np.ndarray,
             remaining: Sequence[_Remaining], odds: Odds) -> _Tried:
    """Experiment with the expected size of the 90 % set after it, whichever model is true."""
    prior = np.array([one.ranked.probability for one in remaining])
    sizes = [_set_size(odds(prior, row)) for row in apart]
    least = apart[~np.eye(len(apart), dtype=bool)].min()
    return _Tried(log, motions, float(least), float(prior @ sizes / prior.sum()))


def _whitened(residuals: ResidualModel, motion: np.ndarray) -> np.ndarray:
    """Motion of all joints as the evidence counts it, one after another."""
    slow = decimated(motion, residuals.problem.period)
    return np.concatenate([whiten(slow[:, k], noise.whitener)
                           for k, noise in enumerate(residuals.noises)])


def _set_size(odds: np.ndarray) -> int:
    """How many causes hold nine tenths of the probability."""
    held = np.cumsum(np.sort(odds / odds.sum())[::-1])
    return 1 + int(np.sum(held < SET_PROBABILITY))


def _odds_after(residuals: ResidualModel, nominal: Fit, remaining: Sequence[_Remaining]) -> Odds:
    """Function that gives the odds of hypotheses after a run that separates them.

    The verdict weighs what a hypothesis leaves per sample, so the run is added to the old logs.
    """
    calibration, n = residuals.method.calibration, residuals.problem.n
    old = nominal.samples.sum()
    new = n * residuals.method.assessment.experiment_duration * RATE
    excess = np.array([one.excess for one in remaining])

    def odds(prior: np.ndarray, apart: np.ndarray) -> np.ndarray:
        after = (excess * old + n * np.array(apart)) / (old + new)
        gain = (calibration.score(after, nominal.excess)
                - calibration.score(excess, nominal.excess))
        return prior * np.exp(gain - gain.max())

    return odds
