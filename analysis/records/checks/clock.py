"""Checks of the clock: unit, order, repeats, gaps, jitter, and the stated rate."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import MOST_RANGES, Finding, ranges
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot

GAP = 3  # sample times
COARSE = 0.01  # share of repeated stamps
ROUNDED = 0.02  # relative error of a tick
JITTER = (0.002, 0.10)  # std of the step over its median: worth saying, worth a warning
PLAUSIBLE = (2e-5, 1.0)  # s between samples of a robot log
NEIGHBOURS = 101  # rows over which late rows of a coarse clock even out
LATEST = 3.0  # ticks by which a row of such a clock may be late
SHORTEST_STEP = 0.5  # of the mean step
UNITS = {1e3: "ms", 1e6: "us", 1e9: "ns"}


def check_clock(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on the stamps of a record."""
    if not record.sample_time > 0:
        return [Finding("error", "clock.stopped", "The clock never advances.",
                        "Without time there is no velocity and no model.",
                        "Name the right column: --map time=COLUMN.")]
    step = np.diff(record.time)
    unit = _unit(record, robot)
    return [*_order(step), *_repeats(step), *_gaps(record, step), *_jitter(record, step),
            *(unit or _rate(record, robot))]


def even_clock(record: Record, robot: Robot | None = None) -> Record:
    """Return the record with a coarse clock rebuilt from its rate, or as it is.

    Each segment gets even steps, of the stated period where its stamps agree with that, else of
    its mean one; the samples are not touched.  Where no even clock gives the stamps, to one of its
    ticks, since rows were late now and then, they follow the mean over many rows; stamps that do
    not even follow that stay.
    """
    if not is_coarse(record):
        return record
    robot = robot or record.robot
    time, stated = record.time.copy(), robot.controller.sample_time if robot else None
    tick = clock_tick(record)
    for start, stop in record.segments:
        stamps = record.time[start:stop]
        rebuilt = _even_stamps(stamps, tick, stated)
        rebuilt = _mean_stamps(stamps, tick) if rebuilt is None else rebuilt
        if rebuilt is None:
            return record
        time[start:stop] = rebuilt
    return record.replace(time=time).noted(
        "The clock is coarser than the sampling; its stamps were rebuilt from its mean rate.")


def _even_stamps(stamps: np.ndarray, tick: float, stated: float | None) -> np.ndarray | None:
    """Even stamps within one tick of the logged ones; None where there are none."""
    rows = np.arange(stamps.size)
    centred = rows - rows.mean()
    mean = float(centred @ stamps) / max(float(centred @ centred), 1.0)
    for step in (stated, mean):
        if step is None:
            continue
        late = stamps - step * rows  # rounded to a tick, or as it last ticked
        if np.ptp(late) <= (1 + ROUNDED) * tick:
            return step * rows + (late.min() + late.max()) / 2
    return None


def _mean_stamps(stamps: np.ndarray, tick: float) -> np.ndarray | None:
    """Stamps on a line through their neighbours; None where some are many ticks off."""
    if is_decimal(tick) or stamps.size < NEIGHBOURS:
        return None
    from scipy.signal import savgol_filter

    smooth = savgol_filter(stamps, NEIGHBOURS, 1)
    late = np.abs(stamps - smooth)
    steps = np.diff(smooth)
    even = steps.min() > SHORTEST_STEP * steps.mean()
    return smooth if even and late.max() <= LATEST * tick else None


def is_coarse(record: Record) -> bool:
    """Whether more stamps repeat than by rows that were written twice."""
    return _is_coarse(np.diff(record.time))


def is_even(record: Record) -> bool:
    """Whether the steps of a clock are the same within each segment."""
    return all(np.ptp(np.diff(record.time[start:stop])) < ROUNDED * record.sample_time
               for start, stop in record.segments if stop - start > 2)


def clock_tick(record: Record) -> float:
    """Smallest step of a clock [s]."""
    step = np.diff(record.time)
    return float(step[step > 0].min(initial=np.inf))


def is_decimal(tick: float) -> bool:
    """Whether a tick is that of stamps which were written with too few decimals."""
    digits = np.log10(tick)
    return bool(abs(digits - np.round(digits)) < ROUNDED)


def without_copies(record: Record) -> Record:
    """Return the record without the rows that the next one repeats, as `valid` marks them."""
    copies = np.append(np.diff(record.time) == 0, False) & ~record.valid
    return record.rows(~copies) if copies.any() else record


def _is_coarse(step: np.ndarray) -> bool:
    return bool(np.mean(step == 0) > COARSE) if step.size else False


def _order(step: np.ndarray) -> list[Finding]:
    backward = np.flatnonzero(step < 0)
    if backward.size == 0:
        return []
    where = _around(backward)
    if backward.size == 1:
        return [Finding("repair", "clock.reset", f"The clock jumps back once, by "
                        f"{-step[backward[0]]:.6g} s.", "It was reset or the logs were joined.",
                        "The record is split there; nothing to do.", samples=where)]
    return [Finding("error", "clock.backward", f"The clock runs backwards {backward.size} times.",
                    "The order of the samples is not known, so neither is any velocity.",
                    "Sort at the source, or log the stamp of the measurement instead of that of "
                    "its arrival.", samples=where)]


def _around(steps: np.ndarray) -> tuple[tuple[int, int], ...]:
    """Sample ranges around some steps of the clock."""
    return tuple((int(k), int(k) + 2) for k in steps[:MOST_RANGES])


def _repeats(step: np.ndarray) -> list[Finding]:
    share = np.mean(step == 0)
    if share == 0:
        return []
    where = ranges(np.concatenate((step == 0, [False])))[:MOST_RANGES]
    if share <= COARSE:
        return [Finding("repair", "clock.repeated", f"{np.count_nonzero(step == 0)} stamps repeat "
                        "the one before.", "A sample was logged twice.",
                        "The last of each is kept; nothing to do.", samples=where)]
    tick = float(step[step > 0].min(initial=np.inf))
    reason, fix = ("Coarse clock", "log a finer clock")
    if is_decimal(tick):
        reason = f"The stamps are written to {tick:.0g} s, with too few digits"
        fix = "export the clock with more digits, or from the start of the log"
    return [Finding("warning", "clock.coarse", f"{reason}: {share:.0%} of them repeat the one "
                    "before.", "The true sample times are not known.",
                    f"The stamps are rebuilt from the mean rate; {fix}.", samples=where)]


def _gaps(record: Record, step: np.ndarray) -> list[Finding]:
    if _is_coarse(step):
        return []
    gap = step > GAP * record.sample_time
    if not gap.any():
        return []
    lost = float(np.sum(step[gap]))
    return [Finding("warning", "clock.gaps", f"{np.count_nonzero(gap)} gaps, together "
                    f"{lost:.3g} s of {record.duration:.3g} s.", "What happened inside is not "
                    "known.", "The record is split there and nothing is filled in; if they are "
                    "long, log to memory first.",
                    samples=_around(np.flatnonzero(gap)))]


def _jitter(record: Record, step: np.ndarray) -> list[Finding]:
    if _is_coarse(step):
        return []
    usual = step[(step > 0) & (step <= GAP * record.sample_time)]
    size = usual.std() / record.sample_time
    if size < JITTER[0]:
        return []
    what = (f"The step of the clock varies by {size:.1%} (median {1e3 * record.sample_time:.4g} "
            f"ms, mean {1e3 * usual.mean():.4g} ms).")
    if size < JITTER[1]:
        return [Finding("repair", "clock.jitter", what, "Even steps would shift the samples.",
                        "The true stamps are used; nothing to do.")]
    return [Finding("warning", "clock.jitter", what,
                    "The controller's own clock is not this one, so its velocity filter cannot be "
                    "replayed exactly, and lags below one step cannot be measured.",
                    "Log the stamp of the controller's cycle.")]


def _unit(record: Record, robot: Robot | None) -> list[Finding]:
    """Whether the step is a power of a thousand off what is stated, or off what is plausible."""
    step = record.sample_time
    stated = robot.controller.sample_time if robot else None
    if stated:
        for factor, unit in UNITS.items():
            if abs(step / stated / factor - 1) < 0.2:
                return [_wrong_unit(f"The step of the clock is {step:g} s but the robot's sample "
                                    f"time is {stated:g} s: the stamps are in {unit}.", unit)]
    elif not PLAUSIBLE[0] <= step <= PLAUSIBLE[1]:
        return [_wrong_unit(f"The step of the clock would be {step:g} s.", "ms, us or ns")]
    return []


def _wrong_unit(what: str, unit: str) -> Finding:
    return Finding("error", "clock.unit", what,
                   "Every velocity and every parameter would be wrong by powers of a thousand.",
                   f"Read it with --time-unit {unit}.")


def _rate(record: Record, robot: Robot | None) -> list[Finding]:
    stated = robot.controller.sample_time if robot else None
    if not stated or abs(record.sample_time / stated - 1) < 0.01:
        return []
    return [Finding("warning", "clock.rate", f"The log has a step of "
                    f"{1e3 * record.sample_time:.4g} ms, the controller one of "
                    f"{1e3 * stated:.4g} ms.",
                    "The control law cannot be replayed sample by sample.",
                    "Log every cycle of the controller, or correct sample_time_s.")]
