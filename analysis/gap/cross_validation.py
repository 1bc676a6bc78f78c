"""Judging on the data that were fitted, without judging what was fitted: blocked cross-validation.

A log is cut into blocks of some seconds.  Each fold leaves every so many blocks out, with a margin
on both sides that is long against the memory of the loop, refits the model on the rest, and judges
it on the blocks left out.  The model is simulated over the whole log from its true start, so that
no block begins at an unknown state.  Of several logs of which one is too short to be cut, each is
left out whole.
"""

import dataclasses
import itertools

import numpy as np

from clie_blocks.analysis.gap.bench import Bench
from clie_blocks.analysis.gap.fit import fit
from clie_blocks.analysis.gap.noise import decimated

BLOCK = 2.0  # s, least length of a block
BLOCKS = 10  # of a log that is long enough
FOLDS = 5
LEAST_BLOCKS = 4  # below, too little is left to fit to
MARGIN = 0.5  # s on both sides of a block that neither fits nor judges


@dataclasses.dataclass(frozen=True, eq=False)
class Blind(Bench):
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
    count = min(BLOCKS, int(samples * period / BLOCK))
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
        seen = [_seen(length, left_out, period) for length, left_out in zip(lengths, fold)]
        refitted = fit(at, Blind(bench.problem, bench.noises, bench.free, seen=seen), 2).hypothesis
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


def _seen(samples, left_out, period):
    """Whitened rows outside the blocks of a fold and their margins."""
    time = decimated(period * np.arange(samples), period)
    seen = np.ones(len(time), bool)
    for first, last in left_out:
        seen &= (time < first * period - MARGIN) | (time >= last * period + MARGIN)
    return seen
