"""The noise floor of a log: from repeated periods, from repeated runs, or from its roughness.

Only repeats are a measurement: what repeats is the robot, what does not is noise.  Without them
the second difference of the position stands in, which sees white noise alone.
"""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.runs import runs
from clie_blocks.errors import RecordError

MAD_TO_STD = 1.4826
OUTLIER = 4  # standard deviations; steps and impacts are no noise
LEAST_PERIODS = 3
MOST_REPEATED = 400_000  # samples in which periods are sought; memory for more is not needed


@dataclasses.dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Standard deviation of what does not repeat in the measured position.

    Parameters
    ----------
    std : ndarray, shape (n,)
        Noise of one sample of q [unit of q].
    method : str
        ``periods``, ``runs`` or ``second difference``.
    repeats : int
        Periods or runs that were compared; 0 without repeats.
    caveat : str
        Why the figure may mislead; empty when it is a measurement.

    """

    std: np.ndarray
    method: str
    repeats: int
    caveat: str = ""


def noise_floor(record: Record, *others: Record) -> NoiseFloor:
    """Noise floor of q, from the best evidence that the log has.

    Of further runs of the robot, those with the same reference and excitation count.
    """
    twins = [record, *(other for other in others if _same_drive(record, other))]
    if len(twins) > 1:
        size = min(map(len, twins))
        return NoiseFloor(_spread(np.stack([twin.q[:size] for twin in twins])), "runs", len(twins))
    start, stop = max(runs(record), key=lambda run: run[1] - run[0], default=(0, 0))
    stop = min(stop, start + MOST_REPEATED)
    period = repeated_period(record, start, stop)
    if period:
        count = (stop - start) // period - 1  # the first period holds the transient
        cut = record.q[start + period:start + (count + 1) * period]
        return NoiseFloor(_change(cut.reshape(count, period, record.n)), "periods", count)
    std, whiteness = roughness(record)
    return NoiseFloor(std, "second difference", 0, _caveat(whiteness))


@functools.lru_cache(maxsize=2)  # a record does not change, and several checks need it
def roughness(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Noise from the second difference of q, and its whiteness: 1 for white noise, 0 if smooth.

    Returns
    -------
    std, whiteness : ndarray, shape (n,)
        Root mean square of ``(q[k-1] - 2 q[k] + q[k+1]) / sqrt(6)`` without outliers; and the
        ratio to the same over twice the distance, which a low-pass filter makes small.

    """
    near, far = (_second_difference(record, width) for width in (1, 2))
    return near, np.divide(near, far, out=np.ones_like(near), where=far > 0)


def repeated_period(record: Record, start: int, stop: int) -> int:
    """Period of reference and excitation in samples, when at least three fit; else 0."""
    inputs = [x[start:stop, k] for x in (record.qd, record.pe) if x is not None
              for k in range(record.n)]
    drives = [(x, float(np.ptp(x))) for x in inputs if np.ptp(x) > 0]
    if not drives:
        return 0
    for period in _self_similar(drives, (stop - start) // LEAST_PERIODS):
        if all(np.abs(x[2 * period:] - x[period:-period]).max() < 1e-3 * span
               for x, span in drives):
            return int(period)
    return 0


def _self_similar(drives: Sequence[tuple[np.ndarray, float]], longest: int) -> np.ndarray:
    """Shifts at which all drives, of known span, are nearly themselves again, shortest first.

    The mean square of ``drive[k + shift] - drive[k]`` comes from energies and a correlation, which
    takes one transform for all shifts.  One drive after another, as a log may be long.
    """
    count = drives[0][0].size
    size = 1 << (2 * count - 1).bit_length()
    power, square = np.zeros(size // 2 + 1), np.zeros(count)
    for x, span in drives:
        drive = (x - x.mean()) / span
        power += np.abs(np.fft.rfft(drive, size)) ** 2
        square += drive**2
    correlation = np.fft.irfft(power, size)[:longest + 1]
    energy = np.concatenate(([0.0], np.cumsum(square)))
    shift = np.arange(longest + 1)
    ends = energy[count - shift] + energy[-1] - energy[shift]
    apart = (ends - 2 * correlation) / (count - shift)
    middle = apart[1:-1]
    dip = (middle <= apart[:-2]) & (middle < apart[2:]) & (middle < 1e-3 * apart.max())
    return np.flatnonzero(dip) + 1


def _spread(repeats: np.ndarray) -> np.ndarray:
    """Standard deviation over repeats, with the freedom of their mean given back."""
    return np.sqrt(np.nanmean(np.nanvar(repeats, axis=0, ddof=1), axis=0))


def _change(periods: np.ndarray) -> np.ndarray:
    """Standard deviation from neighbouring periods; the median forgives a slow transient."""
    change = np.sqrt(np.nanmean(np.diff(periods, axis=0) ** 2, axis=1))
    return np.median(change, axis=0) / np.sqrt(2)


def _second_difference(record: Record, width: int) -> np.ndarray:
    ranges = runs(record, least=2 * width + 1)
    if not ranges:
        raise RecordError(f"{record.source or 'the record'} has no five valid samples in a "
                          "row, so the noise of its position cannot be estimated; log longer, "
                          "or repair the export")
    return np.array([_bend(np.concatenate([
        q[start:stop][2 * width:] - 2 * q[start:stop][width:-width] + q[start:stop][:-2 * width]
        for start, stop in ranges])) for q in record.q.T])


def _bend(bends: np.ndarray) -> float:
    """Root mean square of second differences without outliers, over that of white noise."""
    bends = np.abs(bends)
    usual = MAD_TO_STD * np.median(bends)
    kept = bends[bends <= OUTLIER * usual] if usual else bends  # the median is coarse on a lattice
    return float(np.sqrt(np.sum(kept**2) / kept.size / 6))


def _same_drive(one: Record, other: Record) -> bool:
    """Whether two runs had the same reference and excitation, sample by sample."""
    if one.n != other.n or abs(len(one) - len(other)) > 0.01 * len(one):
        return False
    size = min(len(one), len(other))
    pairs = [(getattr(one, name), getattr(other, name)) for name in ("qd", "pe")]
    if any((a is None) != (b is None) for a, b in pairs) or pairs[0][0] is None:
        return False
    return all(a is None or _alike(a[:size], b[:size]) for a, b in pairs)


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two signals are the same wherever both were logged."""
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    return a.size > 0 and np.allclose(a, b, rtol=0, atol=1e-6 * np.ptp(a) + 1e-12)


def _caveat(whiteness: np.ndarray) -> str:
    caveat = "no motion repeats in the log, so slow noise is not measured"
    if np.any(whiteness < 0.8):
        caveat += ("; the position was filtered before it was logged, or moves too fast for its "
                   "rate, so the figure is not its noise")
    return caveat
