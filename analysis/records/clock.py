"""The clock of a log: its unit, repeated stamps, gaps and resets."""

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.units import to_si
from clie_blocks.errors import RecordError

GAP = 3  # sample times; a longer step splits the record
COARSE = 0.01  # share of repeated stamps beyond which the clock is coarse, not disturbed
PLAUSIBLE = (2e-5, 0.5)  # s between samples of a robot log
EPOCH = (9e8, 4.2e9)  # s since 1970: years 1998 to 2103
ORDINARY = 0.999  # quantile of the bends of a signal that still are ordinary
SHARPEST = 2.0  # times that: the sharpest bend with which a signal still goes on
FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def seconds(stamps: np.ndarray, unit: str | None, sample_time: float | None,
            source: str) -> tuple[np.ndarray, list[str]]:
    """Return logged stamps in seconds, and what was decided.

    A unit that is not stated is found where only one makes sense, by the stated period of the
    controller [s] or by what is plausible; else the log is refused.  `source` begins messages.
    """
    notes = []
    step = _median_step(stamps)
    if unit is None:
        unit = _guess(stamps, step, sample_time, source)
        if unit != "s" and step is not None:
            notes.append(f"Took the clock to be in {unit}, since {_reason(step, unit)}.")
    factor = to_si(unit, "time", source)[0]
    origin = stamps[0] if stamps.size and EPOCH[0] < abs(stamps[0]) * factor < EPOCH[1] else 0.0
    if origin:
        notes.append(f"The clock counts from 1970; its first stamp {origin:.17g} became 0 s.")
    return (stamps - origin) * factor, notes


def _median_step(stamps: np.ndarray) -> float | None:
    step = np.diff(stamps)
    step = step[step > 0]
    return float(np.median(step)) if step.size else None


def _guess(stamps: np.ndarray, step: float | None, sample_time: float | None, source: str) -> str:
    if step is None:
        return "s"
    known = [unit for unit, factor in FACTORS.items()
             if sample_time and abs(step * factor / sample_time - 1) < 0.2]
    if known:
        return known[0]
    fits = [unit for unit, factor in FACTORS.items()
            if PLAUSIBLE[0] <= step * factor <= PLAUSIBLE[1]]
    dated = [unit for unit in fits if EPOCH[0] < abs(stamps[0]) * FACTORS[unit] < EPOCH[1]]
    if len(dated) == 1:
        return dated[0]
    if "s" in fits:
        return "s"
    rates = ", ".join(f"{1 / (step * FACTORS[unit]):.4g} Hz if {unit}" for unit in FACTORS)
    raise RecordError(f"{source}: the unit of the clock is not stated, and its step of {step:g} "
                      f"does not decide it ({rates}); state it, as in --time-unit us")


def _reason(step: float, unit: str) -> str:
    return f"its median step of {step:g} is then {1 / (step * FACTORS[unit]):.4g} Hz"


def segments(time: np.ndarray) -> tuple[list[tuple[int, int]], list[str]]:
    """Half-open ranges of stamps [s] without a gap or a backward step, and notes on the cuts."""
    step = np.diff(time)
    typical = _median_step(time)
    backward = np.flatnonzero(step < 0) + 1
    gaps = np.flatnonzero(step > GAP * typical) + 1 if typical else np.empty(0, int)
    cuts = np.union1d(backward, gaps).astype(int)
    edges = [0, *cuts.tolist(), time.size]
    notes = []
    if gaps.size:
        notes.append(f"The clock leaps {gaps.size} times by more than {GAP} sample times, first "
                     f"at {time[gaps[0] - 1]:g} s; nothing was filled in, the record is split.")
    if backward.size:
        notes.append(f"The clock runs backwards {backward.size} times, first at "
                     f"{time[backward[0] - 1]:g} s; the record is split there.")
    return list(zip(edges[:-1], edges[1:])), notes


def repeated_stamps(time: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Mask of the samples whose stamp is repeated by the next one, and a note on them.

    Of samples with one stamp the last counts.  When more than one in a hundred repeats, the clock
    is coarse and all samples are real, so none is marked.

    """
    twin = np.zeros(time.size, bool)
    twin[:-1] = np.diff(time) == 0
    count = int(np.count_nonzero(twin))
    if not count:
        return twin, []
    if count > COARSE * time.size:
        return np.zeros(time.size, bool), [
            f"{count} of {time.size} stamps repeat the one before: the clock is coarser than the "
            "sampling; no sample was dropped."]
    return twin, [f"{count} stamps repeat; of samples with one stamp only the last is used."]


def with_resets_counted_on(record: Record) -> Record:
    """Return the record with a clock that counts on where it was reset within an even log.

    Where every signal goes on over a backward step as it does between any two rows, nothing was
    lost there and only the clock began anew.  Any other backward step stays, and cuts the log.
    """
    step, time = np.diff(record.time), record.time.copy()
    resets = [at for at in (np.flatnonzero(step < 0) + 1).tolist() if _goes_on(record, at)]
    if not resets:
        return record
    for at in resets:
        time[at:] += time[at - 1] + record.sample_time - time[at]
    starts = [start for start, _ in record.segments if start not in resets]
    ends = [stop for _, stop in record.segments if stop not in resets]
    return record.replace(time=time, segments=list(zip(starts, ends, strict=True))).noted(
        "The clock was reset, and was counted on: every signal goes on over the reset.")


def _goes_on(record: Record, at: int) -> bool:
    """Whether all signals go on from the row before `at` as they do elsewhere.

    The measure is the second difference: a lost row or an invented one bends a moving signal by
    its step.
    """
    if not 1 < at < len(record) - 1:
        return False
    for name in record.signals:
        bends = np.abs(np.diff(getattr(record, name), 2, axis=0))
        ordinary = np.nanquantile(bends, ORDINARY, axis=0)
        if not (bends[at - 2:at] <= SHARPEST * ordinary).all():
            return False
    return True
