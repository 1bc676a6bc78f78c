"""Measures of signals that several checks share; plain numpy, since a check must start fast."""

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.runs import runs

TINY = 1e-100
ENOUGH = 10_000  # windows that settle a lag
MANY = 50_000  # windows that settle any other measure
WINDOW = 0.05  # s; half width over which a motion is compared, long against noise and filters


def moves(x: np.ndarray) -> bool:
    """Whether a signal changes at all, by more than what squares to nothing."""
    return x.size > 0 and np.ptp(x) > TINY


def half_width(record: Record, window: float = WINDOW) -> int:
    """Half width in samples of a window of this many seconds, at least one sample."""
    return max(1, round(window / record.sample_time))


def centres(record: Record, width: int) -> np.ndarray:
    """Indices k for which ``k - width`` and ``k + width`` lie in the same run of valid samples.

    Of a long log evenly chosen ones: more settle nothing, and take memory.
    """
    parts = [np.arange(start + width, stop - width) for start, stop in runs(record)
             if stop - start > 2 * width]
    at = np.concatenate(parts) if parts else np.empty(0, int)
    return at[::max(1, at.size // MANY)]


def increments(x: np.ndarray, at: np.ndarray, width: int) -> np.ndarray:
    """Change of a signal over each window: ``x[k + width] - x[k - width]``."""
    return x[at + width] - x[at - width]


def integrals(record: Record, rate: np.ndarray, at: np.ndarray, width: int) -> np.ndarray:
    """Integral of a rate (N, n) over each window, by trapezia on the true stamps."""
    steps = np.diff(record.time)
    return np.column_stack([
        increments(_total(steps * (column[1:] + column[:-1]) / 2), at, width)
        for column in rate.T])


def smooth_motion(record: Record, at: np.ndarray,
                  width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration, averaged over each window, shape (len(at), n).

    The acceleration is ``(q[k+w] - 2 q[k] + q[k-w]) / (wT)^2``; the others are averaged as by
    `triangular_mean`, so that a force averaged in the same way obeys the same equation of motion.
    """
    ahead, here, behind = record.q[at + width], record.q[at], record.q[at - width]
    speeds = []
    for q in record.q.T:
        rate = np.zeros(q.shape)
        rate[1:-1] = (q[2:] - q[:-2]) / (2 * record.sample_time)
        speeds.append(_triangular_mean(rate, at, width))
    return (triangular_mean(record.q, at, width), np.column_stack(speeds),
            (ahead - 2 * here + behind) / (width * record.sample_time) ** 2)


def triangular_mean(x: np.ndarray, at: np.ndarray, width: int) -> np.ndarray:
    """Triangular mean over each window: twice the mean of `width` samples.

    One joint after another, as a log may be long.
    """
    return np.column_stack([_triangular_mean(column, at, width) for column in x.T])


def _triangular_mean(x: np.ndarray, at: np.ndarray, width: int) -> np.ndarray:
    ahead = _total(x)
    ahead[:-width] = ahead[width:] - ahead[:-width]
    total = _total(ahead[:-width])
    return (total[at + 1] - total[at + 1 - width]) / width**2


def _total(x: np.ndarray) -> np.ndarray:
    """Sums of the first 0, 1, ... values, holes left out."""
    total = np.zeros((len(x) + 1, *x.shape[1:]))
    total[1:] = x
    total[~np.isfinite(total)] = 0.0
    return np.cumsum(total, axis=0, out=total)


def slope(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope of y on x through the origin, and their correlation about zero; NaN without x."""
    xx, yy, xy = np.sum(x * x), np.sum(y * y), np.sum(x * y)
    if xx == 0 or yy == 0:
        return np.nan, np.nan
    return xy / xx, xy / np.sqrt(xx * yy)


def correlation_matrix(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Matrix of the correlations about zero of the columns of x with those of y; 0 if dead."""
    size = np.linalg.norm(x, axis=0)[:, None] * np.linalg.norm(y, axis=0)
    return np.divide(x.T @ y, size, out=np.zeros(size.shape), where=size > 0)


def permutation(match: np.ndarray, alike: float = 0.8) -> list[int] | None:
    """Permutation that a matrix of similarities shows beyond doubt, or None.

    ``match[i, j]``, at most 1, is the similarity of row signal i with column signal j, which
    belong together above `alike`.  Element i of the result is the j that belongs to it; each pair
    of a moved joint is alike and the stated pair is not (0.3 less).
    """
    order = match.argmax(axis=1)
    rows = np.arange(len(match))
    moved = order != rows
    if not moved.any() or sorted(order) != list(rows):
        return None
    clear = (match[rows, order] > alike) & (match[rows, rows] < match[rows, order] - 0.3)
    return order.tolist() if clear[moved].all() else None


def lag(record: Record, early: np.ndarray, late: np.ndarray, at: np.ndarray, width: int,
        reach: int = 40) -> float:
    """Samples by which `late` trails `early`, to a fraction of a sample; NaN when not alike.

    Increments around the centres `at` over the half width are compared, so that offsets do not
    count; `reach` is the largest lag tried.
    """
    at = at[(at >= reach + width) & (at < len(record) - reach - width)]
    if at.size < 10:
        return np.nan
    at = at[::max(1, at.size // ENOUGH)]
    change = increments(early, at, width)
    match = np.array([slope(change, increments(late, at + shift, width))[1]
                      for shift in range(-reach, reach + 1)])
    if not np.isfinite(match).all():
        return np.nan
    best = int(match.argmax())
    if not 0 < best < 2 * reach or match[best] < 0.8:
        return np.nan
    before, top, after = match[best - 1:best + 2]
    curvature = before - 2 * top + after
    return best - reach + (0.5 * (before - after) / curvature if curvature else 0.0)


def step_size(x: np.ndarray) -> float:
    """Smallest step of a quantised signal; NaN when its values lie on no lattice."""
    change = np.abs(np.diff(x[np.isfinite(x)]))
    change = change[change > 1e-12 * max(1.0, np.nanmax(np.abs(x), initial=0.0))]
    if change.size < 10:
        return np.nan
    step = change.min()
    near = change[change < 20.5 * step] / step
    on_lattice = np.abs(near - np.round(near)) < 0.05
    return float(np.median(change[change < 1.5 * step])) if (
        near.size > 0.1 * change.size and on_lattice.mean() > 0.98) else np.nan


def longest_flat(x: np.ndarray, long: int = 20) -> tuple[tuple[int, int], float]:
    """Range of the longest run of equal values, and the share of equal neighbours elsewhere.

    Elsewhere is outside all runs of more than `long` samples.
    """
    same = np.diff(x) == 0
    if not same.any():
        return (0, 1), 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(int)))
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    start, stop = int(starts[longest]), int(stops[longest]) + 1
    held = (stops - starts)[stops - starts > long].sum()
    return (start, stop), float((same.sum() - held) / max(same.size - held, 1))
