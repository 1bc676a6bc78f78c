"""The run that best tells the remaining causes apart, as set-points that a robot can follow."""

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from clie_blocks.analysis.gap.assessment.test_motions import (
    Limits,
    elementary_motions,
    motion_limits,
    multisine_motion,
    scale_inside,
)
from clie_blocks.analysis.gap.fitting.fit import Fit
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
    """An experiment inside the limits, and what it would bring."""

    log: Log
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


def next_experiment(residuals: ResidualModel, nominal: Fit, ranking: Sequence[RankedCause],
                    ) -> NextExperiment | None:
    """Return the experiment that separates the causes of the 90 % set.

    None if one cause is left, if the stated limits leave no room beside what the logs reached, or
    if no experiment would leave fewer than there are.

    Elementary experiments and multisines, whose lines, phases and share of set-point and torque
    are searched, are simulated with each remaining model, none of which may leave the robot's
    limits; the whitened distance between two predictions is the evidence that the run would bring,
    and the verdict's own odds say how many causes it would leave.
    """
    method, problem = residuals.method.assessment, residuals.problem
    remaining = _remaining(ranking, method)
    if len(remaining) < 2:
        return None
    limits = motion_limits(problem)
    if np.any(limits.lowest >= limits.highest):
        return None
    odds = _odds_after(residuals, nominal, [fit for _, fit in remaining])

    def tried(log: Log) -> _Tried | None:
        return _simulated(residuals, remaining, limits, odds, log)

    elementary = (tried(log) for log in elementary_motions(problem, limits, method))
    experiments = [one for one in elementary if one is not None]
    experiments += _search_multisines(problem, limits, method, tried)
    present = _set_size(np.array([ranked.probability for ranked, _ in remaining]))
    experiments = [one for one in experiments
                   if one.expected_set_size < present - method.experiment_least_gain]
    if not experiments:
        return None
    menu = sorted(experiments, key=lambda one: one.cost)[:_MENU]
    return NextExperiment([list(ranked.names) for ranked, _ in remaining],
                          [one.row for one in menu], menu[0].row, menu[0].log, problem.period)


def _remaining(ranking: Sequence[RankedCause], method: AssessmentMethod,
               ) -> list[tuple[RankedCause, Fit]]:
    """Hypotheses with causes in the credible set, with their fits."""
    remaining: list[tuple[RankedCause, Fit]] = []
    held = 0.0
    for ranked in ranking:
        if held >= SET_PROBABILITY or len(remaining) == method.experiment_causes:
            break
        held += ranked.probability
        if ranked.fit is not None and ranked.names not in ((NONE,), (UNKNOWN,)):
            remaining.append((ranked, ranked.fit))
    return remaining


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


def _simulated(residuals: ResidualModel, remaining: Sequence[tuple[RankedCause, Fit]],
               limits: Limits, odds: Odds, log: Log) -> _Tried | None:
    """Experiment inside the limits with what it would bring; None where there is none."""
    models = [fit.hypothesis for _, fit in remaining]
    scaled = scale_inside(models, log, limits, residuals.method.assessment)
    if scaled is None:
        return None
    log, motions = scaled
    distances = [_distance(residuals, one, two)
                 for one, two in itertools.combinations(motions, 2)]
    prior = np.array([ranked.probability for ranked, _ in remaining])
    return _Tried(log, min(distances), _expected_size(prior, distances, odds))


def _distance(residuals: ResidualModel, one: np.ndarray, two: np.ndarray) -> float:
    """Whitened squared distance between two models' motions in an experiment."""
    difference = decimated(one - two, residuals.problem.period)
    return float(sum(np.sum(whiten(difference[:, k], noise.whitener) ** 2)
                     for k, noise in enumerate(residuals.noises)))


def _expected_size(prior: np.ndarray, distances: Sequence[float], odds: Odds) -> float:
    """Expected size of the 90 % set after the run, whichever of the hypotheses is true."""
    apart = np.zeros((len(prior), len(prior)))
    for (i, j), distance in zip(itertools.combinations(range(len(prior)), 2), distances):
        apart[i, j] = apart[j, i] = distance
    sizes = [_set_size(odds(prior, row)) for row in apart]
    return float(prior @ sizes / prior.sum())


def _set_size(odds: np.ndarray) -> int:
    """How many causes hold nine tenths of the probability."""
    held = np.cumsum(np.sort(odds / odds.sum())[::-1])
    return 1 + int(np.sum(held < SET_PROBABILITY))


def _odds_after(residuals: ResidualModel, nominal: Fit, fits: Sequence[Fit]) -> Odds:
    """Function that gives the odds of hypotheses after a run that separates them.

    The verdict weighs what a hypothesis leaves per sample, so the run is added to the old logs.
    """
    calibration, n = residuals.method.calibration, residuals.problem.n
    old = nominal.samples.sum()
    new = n * residuals.method.assessment.experiment_duration * RATE
    excess = np.array([fit.excess for fit in fits])

    def odds(prior: np.ndarray, apart: np.ndarray) -> np.ndarray:
        after = (excess * old + n * np.array(apart)) / (old + new)
        gain = (calibration.score(after, nominal.excess)
                - calibration.score(excess, nominal.excess))
        return prior * np.exp(gain - gain.max())

    return odds
