"""Judging on the data that were fitted, without judging what was fitted: blocked cross-validation.

A log is cut into blocks of some seconds.  Each fold leaves every so many blocks out, with a margin
on both sides that is long against the memory of the loop, refits the model on the rest, and judges
it on the blocks left out.  The model is simulated over the whole log from its true start, so that
no block begins at an unknown state.
"""

import dataclasses

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
        For each log the squared error, summed over joints, (N,); None where the logs are too
        short to be cut.

    """
    period = at.problem.period
    edges = [blocks(len(log), period) for log in at.problem.fit]
    if any(len(edge) == 0 for edge in edges):
        return None
    found = [np.zeros(len(log)) for log in at.problem.fit]
    for fold in range(min(FOLDS, min(map(len, edges)) - 1)):
        seen = [_seen(len(log), edge, fold, period) for log, edge in zip(at.problem.fit, edges)]
        blind = Blind(bench.problem, bench.noises, bench.free, seen=seen)
        refitted = fit(at, blind, 2).hypothesis
        for j in logs:
            error = np.sum(refitted.error(j, dithered=False) ** 2, axis=1)
            for first, last in _left_out(edges[j], fold):
                found[j][first:last] = error[first:last]
    return [found[j] for j in logs]


def _left_out(edges, fold):
    folds = min(FOLDS, len(edges) - 1)
    return list(zip(edges[:-1], edges[1:]))[fold::folds]


def _seen(samples, edges, fold, period):
    """Whitened rows outside the blocks of a fold and their margins."""
    time = decimated(period * np.arange(samples), period)
    seen = np.ones(len(time), bool)
    for first, last in _left_out(edges, fold):
        seen &= (time < first * period - MARGIN) | (time >= last * period + MARGIN)
    return seen
