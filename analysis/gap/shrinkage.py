"""How far the gap shrinks: prediction errors of nominal and corrected model on unseen logs."""

import dataclasses

import numpy as np

BLOCK = 2.0  # s, long against the memory of the loop
DRAWS = 400


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
        Whether the logs were held out.

    """

    before: float
    after: float
    floor: float
    percent: float | None
    interval: tuple | None
    unseen: bool


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
    return float(np.sqrt(np.mean(np.concatenate(
        [square_errors(hypothesis, j) for j in judging_logs(hypothesis.problem)]))))


def square_errors(hypothesis, j):
    """Squared error of log j, predicted from reference and excitation alone, over joints (N,)."""
    return np.sum(hypothesis.error(j, dithered=False) ** 2, axis=1)


def shrinkage(base, model, noises):
    """Compare two models on the judging logs.

    Parameters
    ----------
    base, model : Hypothesis
        Refitted nominal model, and the model with its causes.
    noises : sequence of Noise
        One per joint.

    """
    problem = base.problem
    floor = float(np.sqrt(sum(noise.floor**2 for noise in noises)))
    width = max(1, round(BLOCK / problem.period))
    blocks = []
    for j in judging_logs(problem):
        pair = np.stack([square_errors(base, j), square_errors(model, j)], axis=1)
        blocks += [part.mean(axis=0) for part in np.array_split(pair, max(1, len(pair) // width))]
    blocks = np.array(blocks)
    before, after = gap(base), gap(model)
    percent = _percent(before, after, floor)
    picks = np.random.default_rng(0).integers(0, len(blocks), (DRAWS, len(blocks)))
    means = np.sqrt(blocks[picks].mean(axis=1))
    drawn = [_percent(b, a, floor) for b, a in means]
    known = [value for value in drawn if value is not None]
    interval = (None if percent is None or len(known) < DRAWS // 2
                else tuple(np.quantile(known, [0.025, 0.975]).tolist()))
    return Shrinkage(before, after, floor, percent, interval, bool(problem.held_out))


def _percent(before, after, floor):
    """Share of the reducible gap that is removed [%]; None within 2 % of the floor."""
    if before <= 1.02 * floor:
        return None
    return 100.0 * (before - after) / (before - floor)
