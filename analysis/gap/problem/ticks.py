"""Records on the ticks of their controller: one row per period, lost rows filled in and marked.

A controller runs evenly even where its log does not.  So each sample belongs to a tick, whatever
jitter its stamp has, and a lost row is a tick without a sample.  Models run through such a tick;
what stands there only keeps signals finite, and never counts.  Where the clock was reset or stood
still for long nothing leads from one side to the other: there the log is cut into pieces.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.clock import GAP
from clie_blocks.analysis.records.controller_section import MEASURED as MEASURED_TORQUE
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record, read_only
from clie_blocks.analysis.records.replay import sample_time
from clie_blocks.errors import RecordError

FAST_ENOUGH = 5e-4  # s: a servo that is faster is simulated at this period, if its loop is stable
LONGEST_HELD = 2.5e-3  # s, for which a measured torque counts as constant
FINEST_PERIOD = 2e-5  # s, down to which a period is sought at which the loop is stable
OFF_TICK = 0.1  # of a period, by which a sample may miss its tick
AT_TICKS = 0.95  # share of the steps of a clock whose ticks are known
OFF_STEP = 0.01  # of the step of a log, by which that may differ from its ticks
SAME_PERIOD = 1e-3  # relative, between two clocks that show the same period
MOST_PARTS = 10  # of a period, so that the samples of logs of several rates are at ticks
LONGEST_BRIDGE = 0.2  # s without samples that a model runs through; a longer gap cuts the log
LEAST_BRIDGE = 3  # periods that are always run through, in logs of a few hertz
LEAST_USABLE = 0.5  # share of the samples of a log
FORGETTING = 0.02  # share of the phase of a clock against its ticks that each step forgets
ISOLATED = 0.5  # share of changes that stand alone from which on a signal is held, not smooth
MEASURED = ("q", "dq", "tau")  # smooth signals; the others are commanded
NEEDED = ("q", "u", "qd", "pe")  # without one of these a sample does not count


def controller_period(controller: Controller, records: Sequence[Record]) -> float:
    """Period at which a controller is simulated [s], so that each sample of a log is at a tick.

    It is the stated one where the fastest log has that rate, and otherwise a part of the step of
    that log: as short as the stated period, but for fast servos, whose rate no motion shows.  A
    measured torque of an unknown rate goes on between the rows; held over them, it would be late.
    """
    fastest = min(records, key=lambda record: record.sample_time)
    logged, period = fastest.sample_time, sample_time(fastest, controller)
    stated = controller.sample_time
    if stated is None and controller.u_is == MEASURED_TORQUE:
        stated = LONGEST_HELD
    if stated is not None and stated < logged * (1.0 - OFF_TICK):
        finest = max(stated, FAST_ENOUGH)
        period = logged / max(1, np.ceil(logged / finest - OFF_TICK))
        if abs(period - finest) < SAME_PERIOD * finest:
            period = finest
    steps = np.array([record.sample_time for record in records])
    off = [_off_step(steps * parts / period) for parts in range(1, MOST_PARTS + 1)]
    fitting = next((i for i, each in enumerate(off) if each <= OFF_STEP), int(np.argmin(off)))
    return float(period / (fitting + 1))


def _off_step(ratios: np.ndarray) -> float:
    """Largest relative distance of the steps of logs from a number of ticks.

    A log of the controller's own rate may be off by more: its clock is not that of the controller.
    """
    count = np.rint(ratios)
    off = np.abs(ratios - count) / np.maximum(count, 1.0)
    return float(np.max(np.where(np.abs(ratios - 1.0) <= OFF_TICK, 0.0, off)))


def tick_period(record: Record, controller: Controller) -> float:
    """Period of the ticks of a record [s]: its step, or a part of it where rows are uneven.

    A logger that takes a row after one, two or three cycles of the controller has steps of the
    cycle times those numbers, whatever its median is.
    """
    step, steps = record.sample_time, np.diff(record.time)
    steps = steps[(steps > 0) & (steps <= GAP * step)]
    stated = controller.sample_time
    if controller.law == "unknown":
        parts = step / np.arange(1, MOST_PARTS + 1)
    else:
        parts = np.array([step] if stated is None or stated >= step else [step, stated])
    fitting = (float(part) for part in parts if _share_at_ticks(steps, part) >= AT_TICKS)
    return next(fitting, step)


def _share_at_ticks(steps: np.ndarray, period: float) -> float:
    """Share of steps of a clock that are a number of periods, and at least one."""
    count = np.maximum(np.rint(steps / period), 1)
    return float(np.mean(np.abs(steps / period - count) <= OFF_TICK))


def on_ticks(record: Record, period: float, read: Sequence[str] = ()) -> Record:
    """Record with a row at every tick of its period [s]; itself where it is so already.

    Rows that were filled in are not `valid`, and `segments` are the pieces.  A row that lacks a
    signal that the law has `read` does not count, either.

    Raises
    ------
    RecordError
        If less than half of the samples can be used.

    """
    known, usable = _rows(record, (*NEEDED, *read))
    if usable.all() and _is_even(record.time, period):
        return record
    pieces = [_piece(record, known & _between(known, rows), usable, period)
              for rows in _cut(record.time, usable, period)]
    for earlier, later in itertools.pairwise(pieces):  # a clock that was reset goes on
        later["time"] += max(0.0, earlier["time"][-1] + period - later["time"][0])
    ends = np.cumsum([0, *(len(piece["time"]) for piece in pieces)]).tolist()
    joined = {name: read_only(np.concatenate([piece[name] for piece in pieces]))
              for name in pieces[0]}
    extra = {name.removeprefix("+"): joined.pop(name) for name in list(joined) if "+" in name}
    valid = joined.pop("valid") > 0
    return record.replace(**joined, valid=valid, extra=extra,
                          segments=list(zip(ends[:-1], ends[1:]))).noted(
        *_sentences(valid, len(pieces)))


def _rows(record: Record, needed: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the rows of which something is known, and of those that count.

    Of rows with one stamp the last counts.  A row that lacks a value keeps the others; one that
    is complete, and marked as invalid, says nothing.
    """
    complete = np.ones(len(record), bool)
    for name in needed:
        signal = getattr(record, name)
        if signal is not None:
            complete &= np.isfinite(signal).all(axis=1)
    single = np.append(np.diff(record.time) != 0, True)
    usable = record.valid & complete & single
    if usable.mean() < LEAST_USABLE:
        lost = np.flatnonzero(~usable)
        raise RecordError(
            f"{record.source}: {lost.size} of {len(record)} samples cannot be used, first at "
            f"{record.time[lost[0]]:.6g} s: a signal is NaN or infinite, or the sample is marked "
            "as invalid. A diagnosis needs at least half of them: check the export, or leave out "
            "the signal that is empty")
    return single & (record.valid | ~complete), usable


def _between(mask: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Mask of the rows from the first to the last of some."""
    inside = np.zeros_like(mask)
    inside[rows[0]:rows[-1] + 1] = True
    return inside


def _is_even(time: np.ndarray, period: float) -> bool:
    """Whether every step of a clock is one period, up to some jitter."""
    steps = np.diff(time)
    return bool(np.abs(steps - period).max() < 0.5 * period)


def _cut(time: np.ndarray, usable: np.ndarray, period: float) -> list[np.ndarray]:
    """Usable rows of each piece: between resets of the clock and gaps that are too long."""
    rows = np.flatnonzero(usable)
    steps = np.diff(time[rows])
    longest = max(LONGEST_BRIDGE, LEAST_BRIDGE * period)
    return np.split(rows, np.flatnonzero((steps < 0) | (steps > longest)) + 1)


def ticks(stamps: np.ndarray, period: float) -> np.ndarray:
    """Tick of each sample, counted from that of the first: a row that was lost leaves one out.

    A late stamp belongs to the tick before it: the phase of the clock against the ticks is kept
    from step to step, and forgotten slowly, since clocks drift.
    """
    steps, phase, moved = np.diff(stamps) / period, 0.0, []
    for step in steps.tolist():
        count = max(round(step + phase), 1)
        phase = (1.0 - FORGETTING) * (step + phase - count)
        moved.append(count)
    return np.concatenate([[0], np.cumsum(np.array(moved, int))])


def _piece(record: Record, rows: np.ndarray, usable: np.ndarray, period: float,
           ) -> dict[str, np.ndarray]:
    """Channels of one piece with a row per tick, from those rows of the record that are in it."""
    known = ticks(record.time[rows], period)
    every = np.arange(known[-1] + 1)
    channels = {name: getattr(record, name) for name in record.signals}
    channels.update({f"+{name}": value for name, value in record.extra.items()})
    filled = {name: _at_ticks(known, value[rows], every, name in MEASURED)
              for name, value in channels.items()}
    return {**filled, "time": record.time[rows][0] + period * every,
            "valid": np.isin(every, known[usable[rows]]).astype(float)}


def between_samples(record: Record, stride: int) -> Record:
    """Record with `stride` ticks per sample; in between signals are filled in as in a gap."""
    known = stride * np.arange(len(record))
    every = np.arange(stride * len(record))
    channels = {name: read_only(_at_ticks(known, getattr(record, name), every, name in MEASURED))
                for name in record.signals}
    extra = {name: _at_ticks(known, value, every, False) for name, value in record.extra.items()}
    period = record.sample_time / stride
    return record.replace(**channels, extra=extra, time=record.time[0] + period * every,
                          valid=spread(record.valid, stride) > 0, segments=())


def spread(samples: np.ndarray, stride: int) -> np.ndarray:
    """Values of samples at their ticks, and zero in between."""
    values = np.zeros((stride * len(samples), *samples.shape[1:]))
    values[::stride] = samples
    return values


def _at_ticks(known: np.ndarray, values: np.ndarray, every: np.ndarray, smooth: bool,
              ) -> np.ndarray:
    """Signals at every tick, from those at the known ones."""
    if len(known) == len(every) and np.isfinite(values).all():
        return values
    columns = values.reshape(len(values), -1).T
    filled = [_filled(known, column, every, smooth) for column in columns]
    return np.stack(filled, axis=1).reshape(len(every), *values.shape[1:])


def _filled(known: np.ndarray, values: np.ndarray, every: np.ndarray, smooth: bool) -> np.ndarray:
    """One signal at every tick: held where it jumps, else along a curve or a line.

    A command is as smooth as its samples show.
    """
    finite = np.isfinite(values)
    if not finite.any():
        return np.full(len(every), np.nan)
    known, values = known[finite], values[finite]
    if _is_held(values):
        return values[np.searchsorted(known, every, side="right").clip(min=1) - 1]
    filled = np.interp(every, known, values)
    if len(known) > 3 and (smooth or _follows_a_curve(values)):
        from scipy.interpolate import CubicSpline

        lost = np.setdiff1d(every[known[0]:known[-1]], known)
        filled[lost] = CubicSpline(known, values)(lost)
    return filled


def _is_held(values: np.ndarray) -> bool:
    """Whether a signal rests between single steps; a ramp between two rests does not."""
    changes = np.diff(values) != 0.0
    alone = changes & ~np.append(False, changes[:-1]) & ~np.append(changes[1:], False)
    return bool(np.count_nonzero(alone) >= ISOLATED * np.count_nonzero(changes))


def _follows_a_curve(values: np.ndarray) -> bool:
    """Whether a cubic through its neighbours predicts a sample better than a line does."""
    if len(values) < 7:
        return False
    middle, near = values[3:-3], values[2:-4] + values[4:-2]
    far = values[:-6] + values[6:]
    of_line, of_cubic = middle - near / 2, middle - (9.0 * near - far) / 16
    return bool(np.sum(of_cubic**2) < np.sum(of_line**2))


def _sentences(valid: np.ndarray, pieces: int) -> list[str]:
    """What was done to a record."""
    sentences = []
    if (~valid).any():
        sentences.append(f"{np.count_nonzero(~valid)} of {valid.size} cycles of the controller "
                         "have no sample, or none that can be used: models run through them, and "
                         "they do not count.")
    if pieces > 1:
        sentences.append(f"The clock was reset, or stood still for more than {LONGEST_BRIDGE:g} "
                         f"s: the log is cut into {pieces} pieces, each with a start of its own.")
    return sentences
