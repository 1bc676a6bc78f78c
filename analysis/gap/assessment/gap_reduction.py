"""How far the gap shrinks: prediction errors of nominal and corrected model on unseen data."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.prediction_error import rms, square_errors, validation_logs
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

_DRAWS = 400
HELD_OUT, LEFT_OUT, FITTED = (
    "held-out logs", "blocks left out of the fit", "the fitted logs")
Blocks = list[list[tuple[int, int]]]
"""Blocks of each log as ``(first, last)`` sample."""


@dataclasses.dataclass(frozen=True)
class GapReduction:
    """The gap before and after, and the part of the reducible gap that is removed.

    Parameters
    ----------
    before, after, floor : float
        RMS over time, summed over joints in squares: refitted nominal model, corrected model,
        sensor noise alone [rad].
    percent : float or None
        Share of the gap above the floor that is removed [%]; None where there is nothing above.
    interval : tuple of float or None
        Its 95 % interval, from a bootstrap over blocks of the unseen logs.
    unseen : bool
        Whether the models were validated on data that they were not fitted to.
    judged_on : str
        ``held-out logs``, ``blocks left out of the fit`` or ``the fitted logs``.
    earned : float
        Probability that the corrected model predicts unseen data better: the share of the draws
        of the bootstrap that say so, 0 where it removes next to nothing; 1 where there is nothing
        to remove, or no unseen data, or where only the corrected model leaves nothing but noise.
    only_noise : bool
        Whether the corrected model leaves held-out logs no more than noise makes in its loop, and
        the nominal model leaves more.
    """

    before: float
    after: float
    floor: float
    percent: float | None
    interval: tuple[float, float] | None
    unseen: bool
    judged_on: str
    earned: float = 1.0
    only_noise: bool = False


def gap_reduction(nominal: Hypothesis, corrected: Hypothesis, residuals: ResidualModel,
                  ) -> GapReduction:
    """Compare two models on data that they were not fitted to, if there are any.

    The residual model serves the refits of the cross-validation.  Between the counts of a coarse
    encoder less may be left than the noise of these.  Where noise decides how a joint moves, as
    inside a dead zone, the gap of the right model may be the larger one: then the whitened errors
    tell which of the two is right.
    """
    floor = float(np.sqrt(sum(residuals.floors**2)))
    judged_on, before, after = _validation(nominal, corrected, residuals)
    if any(log.rounding is not None for log in corrected.problem.logs):
        floor = min(floor, rms(after))
    method, period = residuals.method.assessment, nominal.problem.period
    percent, drawn = _percent_and_draws(before, after, floor, period, method)
    unseen = judged_on != FITTED
    only_noise = judged_on == HELD_OUT and _leaves_only_noise(nominal, corrected, residuals)
    earned = _earned(percent, drawn, method) if unseen and not only_noise else 1.0
    return GapReduction(rms(before), rms(after), floor, percent, _interval(drawn), unseen,
                        judged_on, earned, only_noise)


def _leaves_only_noise(nominal: Hypothesis, corrected: Hypothesis, residuals: ResidualModel,
                       ) -> bool:
    """Whether one of two models leaves held-out logs no more than noise, and the nominal more."""
    healthy = residuals.method.calibration.healthy
    return (_held_out_excess(corrected, residuals) <= healthy
            < _held_out_excess(nominal, residuals))


def _held_out_excess(model: Hypothesis, residuals: ResidualModel) -> float:
    """Excess that a model leaves in held-out logs."""
    left = samples = 0.0
    for j in validation_logs(model.problem):
        for k, part in enumerate(residuals.whitened(model.error(j), j)):
            left += float(part @ part)
            samples += residuals.samples(part, j, k)
    return (left - samples) * model.problem.n / samples


def bear_out_beyond_noise(nominal: Fit, corrected: Fit, method: Method) -> bool:
    """Whether held-out logs bear a model out by their whitened errors.

    The gap also holds noise that rings in the loop, beside which a small effect goes unseen.
    """
    held_out = slice(len(nominal.hypothesis.problem.fit), None)
    samples = nominal.samples[held_out].sum() / nominal.hypothesis.problem.n
    if not samples:
        return False
    noise = nominal.samples[held_out].sum()
    before, after = ((fit.chi2[held_out].sum() - noise) / samples for fit in (nominal, corrected))
    return bool(before > method.calibration.healthy and 100.0 * (before - max(after, 0.0))
                >= method.assessment.earned_percent * before)


def _earned(percent: float | None, drawn: np.ndarray, method: AssessmentMethod) -> float:
    """Probability that unseen data bear a corrected model out; 1 where they cannot tell."""
    if percent is None or not drawn.size:
        return 1.0
    return float(np.mean(drawn > 0.0)) if percent >= method.earned_percent else 0.0


def reduction_percent(before: list[np.ndarray], after: list[np.ndarray], floor: float,
                      period: float, method: AssessmentMethod,
                      ) -> tuple[float | None, tuple[float, float] | None]:
    """Share of the reducible gap that is removed [%], and its 95 % interval over blocks.

    Parameters
    ----------
    before, after : list of ndarray
        Squared errors of two models, one array per log [rad^2].
    floor : float
        What sensor noise alone leaves [rad].
    period : float
        Sample time [s].
    method : AssessmentMethod
        Length of the blocks, least gap.

    Returns
    -------
    percent : float or None
        None where there is nothing above the floor.
    interval : tuple of float or None
        From a bootstrap over blocks.

    """
    percent, drawn = _percent_and_draws(before, after, floor, period, method)
    return percent, _interval(drawn)


def _percent_and_draws(before: list[np.ndarray], after: list[np.ndarray], floor: float,
                       period: float, method: AssessmentMethod) -> tuple[float | None, np.ndarray]:
    """Share of the reducible gap that is removed [%], and draws of it from a bootstrap.

    There are no draws where most of them leave nothing to remove.
    """
    width = max(1, round(method.bootstrap_block / period))
    pairs = [np.stack(pair, axis=1) for pair in zip(before, after)]
    means = np.array([part.mean(axis=0) for pair in pairs
                      for part in np.array_split(pair, max(1, len(pair) // width))])
    percent = _percent(rms(before), rms(after), floor, method)
    picks = np.random.default_rng(0).integers(0, len(means), (_DRAWS, len(means)))
    drawn = [_percent(b, a, floor, method) for b, a in np.sqrt(means[picks].mean(axis=1))]
    known = np.array([value for value in drawn if value is not None])
    return percent, known if percent is not None and len(known) >= _DRAWS // 2 else np.zeros(0)


def _interval(drawn: np.ndarray) -> tuple[float, float] | None:
    """95 % interval of draws; None without any."""
    if not drawn.size:
        return None
    low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
    return low, high


def _percent(before: float, after: float, floor: float, method: AssessmentMethod) -> float | None:
    """Share of the reducible gap that is removed [%]; None near the floor, or without one."""
    if not np.isfinite(before - after) or before <= method.reducible_from * floor:
        return None
    return 100.0 * (before - after) / (before - floor)


def _validation(nominal: Hypothesis, corrected: Hypothesis, residuals: ResidualModel,
                ) -> tuple[str, list[np.ndarray], list[np.ndarray]]:
    """What the models are compared on, and the squared errors of both, one array per log."""
    logs = validation_logs(nominal.problem)

    def errors_where_unseen(model: Hypothesis) -> list[np.ndarray] | None:
        if model.problem.held_out:
            return [square_errors(model, j) for j in logs]
        return unseen_errors(model, residuals, logs)

    before, after = errors_where_unseen(nominal), errors_where_unseen(corrected)
    if before is None or after is None:
        return (FITTED, [square_errors(nominal, j) for j in logs],
                [square_errors(corrected, j) for j in logs])
    return HELD_OUT if corrected.problem.held_out else LEFT_OUT, before, after


@dataclasses.dataclass(frozen=True, eq=False)
class MaskedResidual(ResidualModel):
    """A residual model of which only some whitened rows count: `seen` marks them for each log."""

    seen: Sequence[np.ndarray] = ()

    def whitened(self, error: np.ndarray, j: int) -> list[np.ndarray]:
        """Residual of each joint on the rows that are seen."""
        return [part[self._rows(part, j)] for part in super().whitened(error, j)]

    def of_runs(self, runs: np.ndarray, j: int) -> list[np.ndarray]:
        """Residuals of each joint for many simulated positions, on the rows that are seen."""
        return [part[:, self._rows(part.T, j)] for part in super().of_runs(runs, j)]

    def samples(self, part: np.ndarray, j: int, k: int) -> float:
        """Whitened samples that count, on the rows that are seen."""
        whole = len(self.initial_responses[j][k])
        return super().samples(part, j, k) * len(part) / whole

    def _rows(self, part: np.ndarray, j: int) -> np.ndarray:
        """Rows that are seen, behind the start of the whitening filter."""
        return self.seen[j][-len(part):]


def unseen_errors(model: Hypothesis, residuals: ResidualModel, logs: Sequence[int],
                  ) -> list[np.ndarray] | None:
    """Squared prediction errors of a model that was refitted without the block it predicts.

    For each of some fit logs the squared error, summed over joints, (N,); None where a single log
    is too short to be cut, or no time is left to refit anything.
    """
    if residuals.is_out_of_time:
        return None
    method, period = residuals.method.assessment, model.problem.period
    lengths = [len(log) for log in model.problem.fit]
    errors = [np.zeros(length) for length in lengths]
    all_folds = folds(lengths, period, method)
    for fold in all_folds:
        if not any(fold[j] for j in logs):
            continue
        seen = [_seen_rows(residuals.rows(j).of_ticks(period * np.arange(length)), left_out,
                           period, method)
                for j, (length, left_out) in enumerate(zip(lengths, fold))]
        masked = MaskedResidual(
            residuals.problem, residuals.noises, residuals.initial_responses, residuals.method,
            residuals.counted, residuals.other_noises, seen=seen)
        refitted = fit(model, masked, method.refit_steps).hypothesis
        for j in logs:
            if fold[j]:
                error = square_errors(refitted, j)
                for first, last in fold[j]:
                    errors[j][first:last] = error[first:last]
    return [errors[j] for j in logs] if all_folds else None


def folds(lengths: Sequence[int], period: float, method: AssessmentMethod) -> list[Blocks]:
    """What each fold leaves out, for logs of some lengths [samples] at a sample time [s].

    Blocks of each log in turn; whole logs, where one of them is too short to be cut.
    """
    edges = [blocks(length, period, method) for length in lengths]
    if all(map(len, edges)):
        count = min(method.folds, min(map(len, edges)) - 1)
        return [[list(itertools.pairwise(edge.tolist()))[fold::count] for edge in edges]
                for fold in range(count)]
    if len(lengths) == 1:
        return []
    return [[[(0, length)] if j == whole else [] for j, length in enumerate(lengths)]
            for whole in range(len(lengths))]


def blocks(samples: int, period: float, method: AssessmentMethod) -> np.ndarray:
    """Edges of the blocks of a log [samples]; an empty array where it is too short."""
    count = min(method.fold_blocks, int(samples * period / method.fold_block))
    if count < method.fold_least_blocks:
        return np.zeros(0, int)
    return np.linspace(0, samples, count + 1).astype(int)


def _seen_rows(time: np.ndarray, left_out: Sequence[tuple[int, int]], period: float,
               method: AssessmentMethod) -> np.ndarray:
    """Whitened rows, at some times, outside the blocks of a fold and their margins."""
    margin = method.fold_margin
    seen = np.ones(len(time), bool)
    for first, last in left_out:
        seen &= (time < first * period - margin) | (time >= last * period + margin)
    return seen
