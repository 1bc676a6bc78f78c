"""How far the gap shrinks: prediction errors of nominal and corrected model on unseen data."""

import dataclasses
import itertools

import numpy as np

from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.prediction_error import _rms, square_errors, validation_logs
from clie_blocks.analysis.gap.residual.noise import decimated
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

BLOCK = 2.0  # s, long against the memory of the loop
DRAWS = 400
HELD_OUT, LEFT_OUT, FITTED = (
    "held-out logs", "blocks left out of the fit", "the fitted logs")


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
        Whether no model was fitted to the data that judge it.
    judged_on : str
        ``held-out logs``, ``blocks left out of the fit`` or ``the fitted logs``.

    """

    before: float
    after: float
    floor: float
    percent: float | None
    interval: tuple | None
    unseen: bool
    judged_on: str


def gap_reduction(base, model, bench):
    """Compare two models on data that they were not fitted to, if there are any.

    Parameters
    ----------
    base, model : Hypothesis
        Refitted nominal model, and the model with its causes.
    bench : Bench
        Whitening, for the refits of the cross-validation.

    """
    floor = float(np.sqrt(sum(noise.floor**2 for noise in bench.noises)))
    judged_on, before, after = _validation(base, model, bench)
    percent, interval = reduction_percent(before, after, floor, base.problem.period)
    return GapReduction(_rms(before), _rms(after), floor, percent, interval,
                     judged_on != FITTED, judged_on)


def reduction_percent(before, after, floor, period):
    """Share of the reducible gap that is removed [%], and its 95 % interval over blocks.

    Parameters
    ----------
    before, after : list of ndarray
        Squared errors of two models, one array per log [rad^2].
    floor : float
        What sensor noise alone leaves [rad].
    period : float
        Sample time [s].

    Returns
    -------
    percent : float or None
        None where there is nothing above the floor.
    interval : tuple of float or None
        From a bootstrap over blocks.

    """
    width = max(1, round(BLOCK / period))
    pairs = [np.stack(pair, axis=1) for pair in zip(before, after)]
    blocks = np.array([part.mean(axis=0) for pair in pairs
                       for part in np.array_split(pair, max(1, len(pair) // width))])
    percent = _percent(_rms(before), _rms(after), floor)
    picks = np.random.default_rng(0).integers(0, len(blocks), (DRAWS, len(blocks)))
    drawn = [_percent(b, a, floor) for b, a in np.sqrt(blocks[picks].mean(axis=1))]
    known = [value for value in drawn if value is not None]
    interval = (None if percent is None or len(known) < DRAWS // 2
                else tuple(np.quantile(known, [0.025, 0.975]).tolist()))
    return percent, interval


def _validation(base, model, bench):
    """What judges, and the squared errors of both models there, one array per log."""
    logs = validation_logs(base.problem)
    found = [_unseen_errors(at, bench, logs) for at in (base, model)]
    if any(errors is None for _, errors in found):
        return FITTED, *([square_errors(at, j) for j in logs] for at in (base, model))
    return found[1][0], found[0][1], found[1][1]


def _unseen_errors(at, bench, logs):
    """What judges a model that did not learn from it, and its squared errors there, or None."""
    if at.problem.held_out:
        return HELD_OUT, [square_errors(at, j) for j in logs]
    return LEFT_OUT, unseen_errors(at, bench, logs)


def _percent(before, after, floor):
    """Share of the reducible gap that is removed [%]; None within 2 % of the floor."""
    if before <= 1.02 * floor:
        return None
    return 100.0 * (before - after) / (before - floor)


FOLD_BLOCK = 2.0  # s, least length of a block
BLOCKS = 10  # of a log that is long enough
FOLDS = 5
LEAST_BLOCKS = 4  # below, too little is left to fit to
MARGIN = 0.5  # s on both sides of a block that neither fits nor judges


@dataclasses.dataclass(frozen=True, eq=False)
class MaskedResidual(ResidualModel):
    """A bench that does not see some rows of each log.

    Parameters
    ----------
    seen : list of ndarray
        For each log, which of its whitened rows count.

    """

    seen: list = ()

    def whitened(self, error, j):
        """Residual of each joint on the rows that are seen."""
        return [part[self._rows(part, j)] for part in super().whitened(error, j)]

    def residuals(self, runs, j):
        """Residuals of each joint for many simulated positions, on the rows that are seen."""
        return [part[:, self._rows(part.T, j)] for part in super().residuals(runs, j)]

    def _rows(self, part, j):
        """Rows that are seen, behind the start of the whitening filter."""
        return self.seen[j][-len(part):]


def blocks(samples, period):
    """Edges of the blocks of a log [samples]; an empty array where it is too short."""
    count = min(BLOCKS, int(samples * period / FOLD_BLOCK))
    if count < LEAST_BLOCKS:
        return np.zeros(0, int)
    return np.linspace(0, samples, count + 1).astype(int)


def unseen_errors(at, bench, logs):
    """Squared prediction errors of a model that was refitted without the block it predicts.

    Parameters
    ----------
    at : Hypothesis
        A fitted model.
    bench : Bench
        Whitening.
    logs : sequence of int
        Fit logs to judge on.

    Returns
    -------
    list of ndarray
        For each log the squared error, summed over joints, (N,); None where a single log is too
        short to be cut.

    """
    lengths, period = [len(log) for log in at.problem.fit], at.problem.period
    found = [np.zeros(length) for length in lengths]
    all_folds = folds(lengths, period)
    for fold in all_folds:
        judged = [j for j in logs if fold[j]]
        if not judged:
            continue
        seen = [_seen_rows(length, left_out, period) for length, left_out in zip(lengths, fold)]
        refitted = fit(at, MaskedResidual(bench.problem, bench.noises, bench.free, seen=seen), 2).hypothesis
        for j in judged:
            error = np.sum(refitted.error(j, dithered=False) ** 2, axis=1)
            for first, last in fold[j]:
                found[j][first:last] = error[first:last]
    return [found[j] for j in logs] if all_folds else None


def folds(lengths, period):
    """What each fold leaves out: for each log a list of ``(first, last)`` sample.

    Parameters
    ----------
    lengths : sequence of int
        Samples of each log.
    period : float
        Sample time [s].

    """
    edges = [blocks(length, period) for length in lengths]
    if all(map(len, edges)):
        count = min(FOLDS, min(map(len, edges)) - 1)
        return [[list(itertools.pairwise(edge))[fold::count] for edge in edges]
                for fold in range(count)]
    if len(lengths) == 1:
        return []
    return [[[(0, length)] if j == whole else [] for j, length in enumerate(lengths)]
            for whole in range(len(lengths))]


def _seen_rows(samples, left_out, period):
    """Whitened rows outside the blocks of a fold and their margins."""
    time = decimated(period * np.arange(samples), period)
    seen = np.ones(len(time), bool)
    for first, last in left_out:
        seen &= (time < first * period - MARGIN) | (time >= last * period + MARGIN)
    return seen
