"""Records on an even clock, without inventing data.

Nothing is interpolated over a gap or across a masked sample, and no rate above the logged one is
made.  Going to a slower rate, all signals pass the same zero-phase low-pass first: what would fold
back is removed, and a linear relation between the signals stays true.  Where that filter would
reach beyond a segment or into a masked sample, the result is masked too.
"""

import numpy as np

from clie_blocks.analysis.records.model import Record, read_only
from clie_blocks.errors import RecordError

REACH = 12  # new samples on each side of the low-pass
CUT = 0.79  # of the new Nyquist frequency, half way down
KAISER = 7.9  # 80 dB: passes 0.58 and stops 1.0 of the new Nyquist frequency
SLOWER = 1.5  # ratio of sample times from which on the low-pass is needed
HELD = ("u", "qd", "pe")


def hold_last(stamps: np.ndarray, values: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the last of (m, n) values at or before each time, and how many times have none.

    Times before the first of the m stamps get NaN.
    """
    order = np.argsort(stamps, kind="stable")
    index = np.searchsorted(stamps[order], at, side="right") - 1
    in_force = values[order][np.maximum(index, 0)].astype(float)
    in_force[index < 0] = np.nan
    return in_force, int(np.count_nonzero(index < 0))


def resample(record: Record, sample_time: float, origin: float | None = None) -> Record:
    """Return a record on an even clock, segment by segment.

    Parameters
    ----------
    record : Record
        The log; its rate must be at least the wanted one.
    sample_time : float
        Wanted step [s].
    origin : float, optional
        A time that lies on the new clock [s]; by default each segment starts its own.

    Returns
    -------
    Record
        Values that cannot be known are NaN and masked.

    Raises
    ------
    RecordError
        If the wanted rate is above the logged one, or no segment is long enough.

    """
    step = record.sample_time
    if not sample_time > 0 or not sample_time > 0.99 * step:
        raise RecordError(f"{record.source}: a step of {sample_time:g} s is shorter than the "
                          f"logged {step:g} s; samples in between would be invented")
    parts = [part for a, b in record.segments
             if (part := _segment(record, a, b, sample_time, origin)) is not None]
    if not parts:
        raise RecordError(f"{record.source}: no segment holds two samples {sample_time:g} s apart")
    sizes = np.cumsum([0, *(part["time"].size for part in parts)])
    joined = {name: read_only(np.concatenate([part[name] for part in parts])) for name in parts[0]}
    valid = joined.pop("valid") > 0
    extra = {name[1:]: joined.pop(name) for name in list(joined) if name.startswith("+")}
    result = record.replace(**joined, valid=valid, extra=extra,
                            segments=list(zip(sizes[:-1], sizes[1:])))
    return result.noted(_sentence(step, sample_time, result))


def align(first: Record, second: Record,
          sample_time: float | None = None) -> tuple[Record, Record]:
    """Return two records on one even clock over the time they share.

    Parameters
    ----------
    first, second : Record
        With clocks that count from the same instant, such as a log and its simulation.
    sample_time : float, optional
        Step [s]; by default that of the slower one.

    Raises
    ------
    RecordError
        If they share no time.

    """
    step = sample_time or max(first.sample_time, second.sample_time)
    start = max(first.time.min(), second.time.min())
    stop = min(first.time.max(), second.time.max())
    if stop - start < step:
        raise RecordError(f"{first.source} and {second.source} share no time: "
                          f"{first.time.min():g} to {first.time.max():g} s against "
                          f"{second.time.min():g} to {second.time.max():g} s")
    first, second = (resample(record, step, origin=start) for record in (first, second))
    ticks = [_ticks(record, start, step) for record in (first, second)]
    return first.rows(np.isin(ticks[0], ticks[1])), second.rows(np.isin(ticks[1], ticks[0]))


def _ticks(record: Record, origin: float | None, step: float) -> np.ndarray:
    return np.rint((record.time - origin) / step).astype(int)


def _segment(record: Record, a: int, b: int, step: float,
             origin: float | None) -> dict[str, np.ndarray] | None:
    """Channels of one segment on the even clock, or None where it is too short."""
    last = np.append(np.diff(record.time[a:b]) > 0, True)  # of repeated stamps the last counts
    stamps = record.time[a:b][last]
    ratio = step / record.sample_time
    factor = max(1, round(ratio)) if ratio > SLOWER else 1
    first = stamps[0] if origin is None else origin + step * np.ceil(
        (stamps[0] - origin) / step - 1e-6)
    count = int(np.floor((stamps[-1] - first) / step + 1e-6)) + 1
    if count < 2:
        return None
    fine = first + (step / factor) * np.arange((count - 1) * factor + 1)
    good = record.valid[a:b][last]
    channels = {name: getattr(record, name) for name in record.signals}
    channels.update({f"+{name}": value for name, value in record.extra.items()})
    resampled = {"time": fine[::factor]}
    whole = _known(stamps, good, fine)
    if factor > 1:
        taps = _taps(factor)
        whole = np.convolve(whole, np.ones(taps.size), "same") > taps.size - 0.5 \
            if whole.size >= taps.size else np.zeros(whole.size, bool)
    for name, value in channels.items():
        rows = _between(stamps, value[a:b][last], fine, name in HELD)
        if factor > 1:
            rows = _filtered(rows, taps)
        rows[~whole] = np.nan
        resampled[name] = rows[::factor]
    return {**resampled, "valid": whole[::factor].astype(float)}


def _neighbours(stamps: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    left = np.clip(np.searchsorted(stamps, at + 1e-9, side="right") - 1, 0, stamps.size - 1)
    right = np.minimum(left + 1, stamps.size - 1)
    exact = np.abs(at - stamps[left]) <= 1e-9
    return left, np.where(exact, left, right)


def _known(stamps: np.ndarray, good: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Whether the samples on both sides of each time can be used."""
    left, right = _neighbours(stamps, at)
    return good[left] & good[right]


def _between(stamps: np.ndarray, values: np.ndarray, at: np.ndarray, is_held: bool) -> np.ndarray:
    """Held rows as they were, measured ones on the line between their neighbours."""
    values = values.reshape(values.shape[0], -1)
    left, right = _neighbours(stamps, at)
    if is_held:
        return values[left].astype(float)
    span = np.where(right > left, stamps[right] - stamps[left], 1.0)
    share = np.where(right > left, (at - stamps[left]) / span, 0.0)[:, None]
    return values[left] + share * (values[right] - values[left])


def _taps(factor: int) -> np.ndarray:
    """Symmetric low-pass for a decimation by `factor`, unit gain at rest."""
    k = np.arange(-REACH * factor, REACH * factor + 1)
    taps = np.sinc(CUT * k / factor) * np.kaiser(k.size, KAISER)
    return taps / taps.sum()


def _filtered(rows: np.ndarray, taps: np.ndarray) -> np.ndarray:
    if len(rows) < taps.size:
        return np.full_like(rows, np.nan)
    clean = np.where(np.isfinite(rows), rows, 0.0)  # those samples are masked, with all they reach
    return np.column_stack([np.convolve(column, taps, "same") for column in clean.T])


def _sentence(step: float, sample_time: float, result: Record) -> str:
    lost = int(np.count_nonzero(~result.valid))
    method = "through a zero-phase low-pass" if sample_time > SLOWER * step else (
        "between neighbouring samples, commands held")
    return (f"Resampled from {step:.6g} s to {sample_time:.6g} s {method}; {lost} of "
            f"{len(result)} samples cannot be known and are masked.")

