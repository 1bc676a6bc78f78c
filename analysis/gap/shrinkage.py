"""How far the gap shrinks: prediction errors of nominal and corrected model on unseen data."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.cross_validation import unseen_errors

BLOCK = 2.0  # s, long against the memory of the loop
DRAWS = 400
HELD_OUT, LEFT_OUT, FITTED = (
    "held-out logs", "blocks left out of the fit", "the fitted logs")


@dataclasses.dataclass(frozen=True)
class Shrinkage:
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


def judging_logs(problem):
    """Indices of the logs on which models are judged: those held out, or all."""
    first = len(problem.fit) if problem.held_out else 0
    return range(first, len(problem.logs))


def gap(hypothesis):
    """Sqrt of the sum over joints of the mean squared prediction error on the judging logs [rad].

    Parameters
    ----------
    hypothesis : Hypothesis
        The model, simulated in closed loop from the start angle.

    """
    return _rms([square_errors(hypothesis, j) for j in judging_logs(hypothesis.problem)])


def square_errors(hypothesis, j):
    """Squared error of log j, predicted from reference and excitation alone, over joints (N,)."""
    return np.sum(hypothesis.error(j, dithered=False) ** 2, axis=1)


def shrinkage(base, model, bench):
    """Compare two models on data that they were not fitted to, if there are any.

    Parameters
    ----------
    base, model : Hypothesis
        Refitted nominal model, and the model with its causes.
    bench : Bench
        Whitening, for the refits of the cross-validation.

    """
    floor = float(np.sqrt(sum(noise.floor**2 for noise in bench.noises)))
    judged_on, before, after = _judged(base, model, bench)
    percent, interval = closed(before, after, floor, base.problem.period)
    return Shrinkage(_rms(before), _rms(after), floor, percent, interval,
                     judged_on != FITTED, judged_on)


def closed(before, after, floor, period):
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


def _judged(base, model, bench):
    """What judges, and the squared errors of both models there, one array per log."""
    logs = judging_logs(base.problem)
    found = [_unseen(at, bench, logs) for at in (base, model)]
    if any(errors is None for _, errors in found):
        return FITTED, *([square_errors(at, j) for j in logs] for at in (base, model))
    return found[1][0], found[0][1], found[1][1]


def _unseen(at, bench, logs):
    """What judges a model that did not learn from it, and its squared errors there, or None."""
    if at.problem.held_out:
        return HELD_OUT, [square_errors(at, j) for j in logs]
    return LEFT_OUT, unseen_errors(at, bench, logs)


def _rms(squares):
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def _percent(before, after, floor):
    """Share of the reducible gap that is removed [%]; None within 2 % of the floor."""
    if before <= 1.02 * floor:
        return None
    return 100.0 * (before - after) / (before - floor)
