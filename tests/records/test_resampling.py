"""Even clocks without invented data: masks over gaps, no folding, held inputs exact."""

import numpy as np
import pytest

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.resampling import REACH, align, hold_last, resample
from clie_blocks.errors import RecordError

RNG = np.random.default_rng(3)
TIME = np.arange(5000) / 1000


def sine(time, hertz):
    return np.sin(2 * np.pi * hertz * time)


def amplitude(record, hertz):
    good = record.valid
    wave = np.exp(-2j * np.pi * hertz * record.time[good])
    return 2 * abs(np.mean(record.q[good, 0] * wave))


def test_what_would_fold_is_removed_and_the_rest_is_kept():
    record = resample(Record(TIME, sine(TIME, 10)), 0.01)
    assert record.sample_time == pytest.approx(0.01)
    np.testing.assert_allclose(record.q[record.valid, 0],
                               sine(record.time[record.valid], 10), atol=1e-3)
    folding = resample(Record(TIME, sine(TIME, 90)), 0.01)  # would appear as 10 Hz
    assert amplitude(folding, 10) < 1e-3
    assert amplitude(Record(TIME[::10], sine(TIME, 90)[::10]), 10) > 0.99


def test_linear_relations_between_signals_survive():
    q = RNG.normal(size=(5000, 2))
    record = resample(Record(TIME, q, u=3 * q, qd=-q, dq=2 * q), 0.004)
    good = record.valid
    np.testing.assert_allclose(record.u[good], 3 * record.q[good], atol=1e-12)
    np.testing.assert_allclose(record.qd[good], -record.q[good], atol=1e-12)
    np.testing.assert_allclose(record.dq[good], 2 * record.q[good], atol=1e-12)


def test_the_filter_reaches_no_further_than_it_says():
    record = resample(Record(TIME, sine(TIME, 1)), 0.01)
    assert np.flatnonzero(~record.valid).tolist() == [*range(REACH), *range(500 - REACH, 500)]
    assert np.isnan(record.q[~record.valid]).all()


def test_nothing_is_interpolated_over_a_gap_or_a_masked_sample():
    keep = (TIME < 2) | (TIME >= 3)
    valid = np.ones(keep.sum(), bool)
    valid[500] = False
    record = Record(TIME[keep], sine(TIME[keep], 2), valid=valid,
                    segments=[(0, 2000), (2000, 4000)])
    for step in (0.001, 0.01):
        even = resample(record, step)
        assert not ((even.time > 2) & (even.time < 3 - 1e-9)).any()
        assert len(even.segments) == 2
        assert not even.valid[np.argmin(abs(even.time - 0.5))]
        reach = REACH * step if step > 0.001 else 1e-3
        near = (abs(even.time - 0.5) > reach) & (even.time > reach) & (even.time < 2 - reach)
        assert even.valid[near].all()


def test_an_even_clock_is_left_bit_for_bit():
    q = RNG.normal(size=(5000, 2))
    record = resample(Record(TIME, q, u=q), 0.001)
    np.testing.assert_array_equal(record.q, q)
    np.testing.assert_array_equal(record.u, q)
    assert record.valid.all()


def test_on_a_jittered_clock_commands_are_held_and_positions_follow_their_line():
    time = np.cumsum(0.01 * (1 + 0.4 * RNG.uniform(-1, 1, 400)))
    command = np.arange(400.0)
    record = Record(time, 5 * time, u=command, extra={"supply": 7 + 0 * time})
    even = resample(record, 0.0105)
    np.testing.assert_allclose(even.q[:, 0], 5 * even.time, atol=1e-9)
    np.testing.assert_array_equal(even.u[:, 0], command[np.searchsorted(
        time, even.time + 1e-9, side="right") - 1])
    np.testing.assert_allclose(even.extra["supply"][:, 0], 7)


def test_a_higher_rate_is_refused():
    with pytest.raises(RecordError, match="would be invented"):
        resample(Record(TIME, TIME), 0.0005)
    with pytest.raises(RecordError, match="no segment holds two samples"):
        resample(Record(TIME[:3], TIME[:3]), 1.0)


def test_two_records_are_brought_onto_their_common_clock():
    late = Record(TIME + 1.0005, 2 * (TIME + 1.0005))
    first, second = align(Record(TIME, TIME), late)
    np.testing.assert_allclose(first.time, second.time, atol=1e-12)
    np.testing.assert_allclose(2 * first.q, second.q, atol=1e-9)
    assert first.time[0] == pytest.approx(1.0005)
    with pytest.raises(RecordError, match="share no time"):
        align(Record(TIME, TIME), Record(TIME + 50, TIME))


def test_what_was_held_before_the_first_stamp_is_unknown():
    found, early = hold_last(np.array([1.0, 2.0]), np.array([[5.0], [6.0]]),
                             np.array([0, 1, 1.5, 9]))
    assert early == 1
    np.testing.assert_array_equal(found[:, 0], [np.nan, 5, 5, 6])
