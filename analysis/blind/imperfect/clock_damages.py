"""What loggers and exporters do to the rows and stamps of a log: gaps, clocks, rates, length.

Every function changes an `Export` in place and returns what it chose, for the label.
"""

import numpy as np

from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError, Export, Table, period
from clie_blocks.analysis.blind.imperfect.log_damages import Change, Choice

GAP = 0.05  # s
LOST = 20  # rows of each log
JITTER = 0.03  # standard deviation of a stamp, of a step
TICK = 1 / 64  # s, clock of a desktop system
REPEATED = 0.01  # share of the rows
UPTIME, FEW_DIGITS = 1000.0, 6  # s on the clock when the log begins; digits of the stamps
SHORT = 5.0  # s


def clock_in_ms(export: Export, rng: np.random.Generator) -> Choice:
    """Stamps in milliseconds."""
    for table in export.logs.values():
        table["time"] = 1e3 * table["time"]
    return {}


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
