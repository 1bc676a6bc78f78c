"""A clock that ticks slowly, of a log whose rows were late now and then."""

import numpy as np

from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.checks.clock import even_clock, is_even

TICK, STEP = 0.0156, 0.0150


STALLS = (300, 600, 900)


def ticking():
    """Record whose true times are even but for some stalls, on a clock that ticks."""
    time = STEP * np.arange(1200)
    for late in STALLS:
        time[late:] += 0.02
    return Record(time=TICK * np.floor(time / TICK), q=np.sin(time)[:, None]), time


def test_late_rows_of_a_slow_clock_keep_their_order():
    record, true = ticking()
    rebuilt = even_clock(record)
    assert np.all(np.diff(rebuilt.time) > 0.5 * STEP) and len(rebuilt) == len(record)
    rows = np.arange(1200)  # a stall itself is spread over its neighbours
    away = np.min([np.abs(rows - at) for at in (0, *STALLS, 1199)], axis=0) > 60
    shift = np.median(rebuilt.time - true)
    assert np.abs(rebuilt.time - true - shift)[away].max() < 0.5 * TICK


def test_even_rows_stay_on_a_strictly_even_clock():
    time = STEP * np.arange(1200)
    record = Record(time=TICK * np.floor(time / TICK), q=np.sin(time)[:, None])
    assert is_even(even_clock(record)) and not is_even(even_clock(ticking()[0]))


def test_a_clock_that_stood_still_for_long_stays():
    record, _ = ticking()
    time = record.time.copy()
    time[600:] += 1.0
    broken = Record(time=time, q=record.q, segments=[(0, 1200)])
    assert even_clock(broken) is broken
