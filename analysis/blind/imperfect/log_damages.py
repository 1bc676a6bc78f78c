"""What loggers and exporters do to a log: units, sides, signs, channels, clock, resolution.

Every function changes an `Export` in place and returns what it chose, for the label.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.imperfect.export import (
    DoesNotApplyError,
    Export,
    Table,
    columns,
    period,
)

Choice = dict[str, Any]
Change = Callable[[Export, np.random.Generator], Choice]
GAP = 0.05  # s
LOST, NOT_NUMBERS = 20, 10  # rows of each log
JITTER = 0.03  # standard deviation of a stamp, of a step
TICK = 1 / 64  # s, clock of a desktop system
REPEATED = 0.01  # share of the rows
UPTIME, FEW_DIGITS = 1000.0, 6  # s on the clock when the log begins; digits of the stamps
STEP_12_BIT = 2 * np.pi / 4096  # rad
SHORT = 5.0  # s
THIRD_DIFFERENCE = np.sqrt(20.0)  # standard deviation by that of the samples, white noise
MAD_TO_STD = 1.4826


def scale(factor: float, *signals: str) -> Change:
    """Return the change to another unit, which no header mentions."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        export.change(signals, lambda x: factor * x)
        return {"factor": factor}
    return change


def clock_in_ms(export: Export, rng: np.random.Generator) -> Choice:
    """Stamps in milliseconds."""
    for table in export.logs.values():
        table["time"] = 1e3 * table["time"]
    return {}


def percent_of_rated(export: Export, rng: np.random.Generator) -> Choice:
    """Torques in percent of the rated torque, as drives report them."""
    peak = export.stated("motor", "peak_torque_nm")
    rated = np.array([float(f"{x:.2g}") for x in peak / rng.uniform(2.0, 4.0, peak.size)])
    export.change(("u", "pe"), lambda x: 100 * x / rated)
    return {"rated": rated.tolist()}


def joint_side(export: Export, rng: np.random.Generator) -> Choice:
    """Torques on the joint side."""
    ratio = export.stated("motor", "gear_ratio")
    if ratio.max() < 1.5:
        raise DoesNotApplyError("both sides of the gear are the same")
    export.change(("u", "pe"), lambda x: ratio * x)
    return {}


def turn_sign(signal: str) -> Change:
    """Return the change of sign of a signal at one joint."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        k = int(rng.integers(export.joints))
        sign = np.where(np.arange(export.joints) == k, -1.0, 1.0)
        export.change((signal,), lambda x: sign * x + 0.0)
        return {"joint": k + 1}
    return change


def swap(signal: str) -> Change:
    """Return the swap of a signal between two joints."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        if export.joints < 2:
            raise DoesNotApplyError("one joint")
        one, other = sorted(map(int, rng.choice(export.joints, 2, replace=False)))
        order = np.arange(export.joints)
        order[[one, other]] = order[[other, one]]
        export.change((signal,), lambda x: x[:, order])
        return {"joints": [one + 1, other + 1]}
    return change


def late_command(export: Export, rng: np.random.Generator) -> Choice:
    """Commands that arrive some samples late, at all joints."""
    late = int(rng.integers(3, 11))
    export.change(("u",), lambda x: _delayed(x, late))
    return {"samples": late}


def late_position(export: Export, rng: np.random.Generator) -> Choice:
    """Position of one joint that arrives some samples late."""
    k, late = int(rng.integers(export.joints)), int(rng.integers(3, 11))
    export.change(("q",), lambda x: np.where(np.arange(x.shape[1]) == k, _delayed(x, late), x))
    return {"joint": k + 1, "samples": late}


def _delayed(x: np.ndarray, late: int) -> np.ndarray:
    return np.concatenate([np.repeat(x[:1], late, axis=0), x[:-late]])


def shift_position(*signals: str) -> Change:
    """Return the change of the zero of one joint."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        if "qd" in signals and not export.stated("nominal", "gravity"):
            raise DoesNotApplyError("nothing depends on the pose")
        k, offset = int(rng.integers(export.joints)), rng.choice([-1, 1]) * rng.uniform(0.1, 0.3)
        shift = np.where(np.arange(export.joints) == k, round(float(offset), 4), 0.0)
        export.change(signals, lambda x: x + shift)
        return {"joint": k + 1, "offset": round(float(offset), 4)}
    return change


def hold(signal: str) -> Change:
    """Return the change to a dead channel: the first value of one joint, for ever."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        k = int(rng.integers(export.joints))
        export.change((signal,), lambda x: np.where(np.arange(x.shape[1]) == k, x[:1], x))
        return {"joint": k + 1}
    return change


def lose(signal: str) -> Change:
    """Return the loss of a signal; one that is zero in all logs is not missed."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        logs = export.logs.values()
        if not any(np.ptp(table[name]) for table in logs for name in columns(table, signal)):
            raise DoesNotApplyError(f"{signal} does not change")
        for table in logs:
            for name in columns(table, signal):
                del table[name]
        return {}
    return change


def coarse_position(export: Export, rng: np.random.Generator) -> Choice:
    """Position with 12 bit per turn; the controller has the finer one."""
    export.change(("q",), lambda x: STEP_12_BIT * np.round(x / STEP_12_BIT))
    return {}


def add_noise(factor: float) -> Change:
    """Return the growth of the noise of the logged position by a factor."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        step = float(np.max(export.stated("encoder", "resolution_rad")))

        def noisy(x: np.ndarray) -> np.ndarray:
            rough = np.abs(np.diff(x, 3, axis=0))
            noise = MAD_TO_STD * np.median(rough, axis=0) / THIRD_DIFFERENCE
            x = x + np.sqrt(factor**2 - 1) * noise * rng.standard_normal(x.shape)
            return step * np.round(x / step)
        export.change(("q",), noisy)
        return {"factor": factor}
    return change


def cut_gap(export: Export, rng: np.random.Generator) -> Choice:
    """One gap in each log."""
    def outside(table: Table) -> np.ndarray:
        time = table["time"]
        start = time[int(rng.uniform(0.2, 0.8) * time.size)]
        return (time < start) | (time >= start + GAP)
    export.keep(outside)
    return {}


def lose_rows(export: Export, rng: np.random.Generator) -> Choice:
    """Single rows that the logger dropped, here and there."""
    def kept(table: Table) -> np.ndarray:
        rows = table["time"].size
        lost = rng.choice(np.arange(1, rows - 1), LOST, replace=False)
        return ~np.isin(np.arange(rows), lost)
    export.keep(kept)
    return {"rows": LOST}


def lose_values(export: Export, rng: np.random.Generator) -> Choice:
    """NaN in the position of one joint, here and there."""
    k = int(rng.integers(export.joints))
    for table in export.logs.values():
        name = columns(table, "q")[k]
        rows = rng.choice(np.arange(1, table[name].size), NOT_NUMBERS, replace=False)
        table[name][rows] = np.nan
    return {"joint": k + 1, "values": NOT_NUMBERS}


def jitter(export: Export, rng: np.random.Generator) -> Choice:
    """Stamps taken a little early or late, of samples that are evenly spaced."""
    for table in export.logs.values():
        shift = JITTER * period(table) * rng.standard_normal(table["time"].size)
        table["time"] = np.maximum.accumulate(table["time"] + np.r_[0.0, shift[1:]])
    return {}


def reset_clock(export: Export, rng: np.random.Generator) -> Choice:
    """Clock that starts from zero again in the middle of each log."""
    for table in export.logs.values():
        row = int(rng.uniform(0.3, 0.7) * table["time"].size)
        table["time"][row:] -= table["time"][row]
    return {}


def repeat_rows(export: Export, rng: np.random.Generator) -> Choice:
    """Rows that are written twice, by a logger that asks faster than the drive answers."""
    def again(table: Table) -> np.ndarray:
        rows = table["time"].size
        twice = rng.choice(rows, round(REPEATED * rows), replace=False)
        return np.sort(np.r_[np.arange(rows), twice])
    export.keep(again)
    return {}


def coarse_clock(export: Export, rng: np.random.Generator) -> Choice:
    """Stamps of a clock that ticks 64 times per second."""
    for table in export.logs.values():
        table["time"] = TICK * np.floor(table["time"] / TICK)
    return {}


def few_digits(export: Export, rng: np.random.Generator) -> Choice:
    """Stamps since power-on, written with too few digits."""
    for table in export.logs.values():
        table["time"] = table["time"] + UPTIME
    export.clock_digits = FEW_DIGITS
    return {}


def log_at(rate: float) -> Change:
    """Return the logging of every so many samples, at the rate next to one [Hz]."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        every = {round(1 / (rate * period(table))) for table in export.logs.values()}
        if min(every) < 2:
            raise DoesNotApplyError(f"the controller is not faster than {rate:g} Hz")
        export.keep(lambda table: np.arange(0, table["time"].size, max(every)))
        return {"every": max(every)}
    return change


def two_rates(export: Export, rng: np.random.Generator) -> Choice:
    """One log at half the rate of the others."""
    name = _one_of_several(export, rng)
    export.logs[name] = {head: column[::2] for head, column in export.logs[name].items()}
    return {"log": name}


def one_log(export: Export, rng: np.random.Generator) -> Choice:
    """A single experiment."""
    name = _one_of_several(export, rng)
    export.logs = {name: export.logs[name]}
    return {"log": name}


def _one_of_several(export: Export, rng: np.random.Generator) -> str:
    if len(export.logs) < 2:
        raise DoesNotApplyError("one log")
    return str(rng.choice(list(export.logs)))


def short_logs(export: Export, rng: np.random.Generator) -> Choice:
    """Logs that end after a few seconds."""
    if max(np.ptp(table["time"]) for table in export.logs.values()) < SHORT:
        raise DoesNotApplyError("the logs are short as they are")
    export.keep(lambda table: table["time"] < table["time"][0] + SHORT)
    return {}
