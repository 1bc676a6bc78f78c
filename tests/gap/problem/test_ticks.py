"""Rows at the ticks of a controller: what was lost is marked, and nothing else is touched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.gap.problem.ticks import (
    LONGEST_BRIDGE,
    between_samples,
    controller_period,
    on_ticks,
    tick_period,
    ticks,
)
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.errors import RecordError

PERIOD = 0.001  # s
TIME = PERIOD * np.arange(3000)
COURSE = np.stack([np.sin(2 * np.pi * TIME), np.cos(3.0 * TIME)], axis=1)
STATED = Controller(law="pd", kp=[40.0], kd=[2.0], sample_time=PERIOD)
STEPS = np.repeat([[0.0, 1.0], [0.5, -1.0], [0.2, 0.3]], 1000, axis=0)


def make_record(time=TIME, keep=slice(None), **changes):
    signals = {"q": COURSE, "u": 2.0 * COURSE, "qd": STEPS, "pe": 3.0 * COURSE, **changes}
    return Record(time=time[keep], **{name: value[keep] for name, value in signals.items()})


def test_a_whole_record_is_returned_as_it_is():
    record = make_record()
    assert on_ticks(record, PERIOD) is record


@given(st.sets(st.integers(1, 2998), max_size=60))
@settings(max_examples=40, deadline=None)
def test_lost_rows_are_marked_and_the_others_stay(lost):
    kept = np.setdiff1d(np.arange(3000), list(lost))
    record = on_ticks(make_record(keep=kept), PERIOD)
    assert len(record) == 3000
    np.testing.assert_array_equal(np.flatnonzero(~record.valid), sorted(lost))
    for name, whole in (("q", COURSE), ("u", 2.0 * COURSE), ("qd", STEPS), ("pe", 3.0 * COURSE)):
        np.testing.assert_array_equal(getattr(record, name)[kept], whole[kept])
        assert np.isfinite(getattr(record, name)).all()
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.08), st.floats(-0.002, 0.002))
@settings(max_examples=40, deadline=None)
def test_a_sample_belongs_to_its_tick_whatever_the_jitter_and_drift_of_its_stamp(
        seed, jitter, drift):
    rng = np.random.default_rng(seed)
    tick = np.sort(rng.choice(3000, 2900, replace=False))
    tick -= tick[0]
    stamps = PERIOD * (tick * (1.0 + drift) + jitter * rng.standard_normal(tick.size))
    np.testing.assert_array_equal(ticks(stamps, PERIOD), tick)


@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 2, 3), (2, 3), (1, 3, 4), (2, 5)]),
       st.floats(0.0, 0.03))
@settings(max_examples=40, deadline=None)
def test_rows_after_some_cycles_of_the_controller_lie_on_its_cycles(seed, cycles, late):
    rng = np.random.default_rng(seed)
    tick = np.cumsum(rng.choice(cycles, 900))
    stamps = PERIOD * (tick + late * rng.uniform(-1.0, 1.0, tick.size))
    record = Record(time=stamps, q=rng.normal(size=(tick.size, 1)))
    period = tick_period(record, STATED)
    assert period == PERIOD
    placed = on_ticks(record, period)
    np.testing.assert_array_equal(np.flatnonzero(placed.valid), tick - tick[0])


@pytest.mark.parametrize("controller", [
    STATED, Controller(law="pd", kp=[40.0], kd=[2.0]), Controller(law="unknown")])
def test_a_late_stamp_or_a_lost_row_is_no_other_period(controller):
    rng = np.random.default_rng(4)
    for steps in (1.0 + 0.2 * rng.standard_normal(2000), rng.choice([1, 1, 1, 2], 2000)):
        record = Record(time=PERIOD * np.cumsum(np.abs(steps)), q=np.zeros((2000, 1)))
        assert tick_period(record, controller) == record.sample_time


def test_rows_of_a_machine_of_unknown_law_have_their_common_divisor():
    steps = PERIOD * np.random.default_rng(3).choice([4, 6, 10], 2000)
    record = Record(time=np.cumsum(steps), q=np.zeros((2000, 1)))
    assert tick_period(record, Controller(law="unknown")) == pytest.approx(2 * PERIOD)


def test_a_smooth_signal_is_bridged_along_a_curve_and_a_constant_one_is_held():
    kept = np.delete(np.arange(3000), np.arange(990, 1020))
    record = on_ticks(make_record(keep=kept), PERIOD)
    np.testing.assert_allclose(record.q, COURSE, atol=1e-5)
    assert set(np.unique(record.qd[:, 0])) == {0.0, 0.5, 0.2}


def test_a_long_gap_and_a_reset_cut_the_log_into_pieces():
    gap = int(1.5 * LONGEST_BRIDGE / PERIOD)
    kept = np.delete(np.arange(3000), np.arange(1000, 1000 + gap))
    record = on_ticks(make_record(keep=kept), PERIOD)
    assert record.segments == ((0, 1000), (1000, 3000 - gap)) and record.valid.all()
    np.testing.assert_array_equal(record.q, COURSE[kept])
    reset = on_ticks(make_record(np.where(np.arange(3000) < 1400, TIME, TIME - TIME[1400])),
                     PERIOD)
    assert reset.segments == ((0, 1400), (1400, 3000)) and reset.valid.all()
    assert "2 pieces" in reset.decisions[-1]


@pytest.mark.parametrize("name", ["q", "u", "qd", "pe"])
def test_a_value_that_is_missing_makes_its_sample_not_count(name):
    signal = {"q": COURSE, "u": 2.0 * COURSE, "qd": STEPS, "pe": 3.0 * COURSE}[name].copy()
    signal[[100, 101, 2000], 1] = np.nan
    record = on_ticks(make_record(**{name: signal}), PERIOD)
    np.testing.assert_array_equal(np.flatnonzero(~record.valid), [100, 101, 2000])
    assert np.isfinite(getattr(record, name)).all()
    logged = np.isfinite(signal)
    np.testing.assert_array_equal(getattr(record, name)[logged], signal[logged])


def test_of_two_rows_with_one_stamp_the_last_counts():
    twice = np.insert(np.arange(3000), 500, 500)
    course = COURSE[twice]
    course[500] = 7.0
    record = on_ticks(Record(time=TIME[twice], q=course), PERIOD)
    np.testing.assert_array_equal(record.q, COURSE)
    assert record.valid.all()


@pytest.mark.parametrize(("stated", "steps", "period"), [
    (None, (0.001, 0.002), 0.001), (0.001, (0.002, 0.02), 0.001), (0.001, (0.001, 0.00101), 0.001),
    (None, (0.001, 0.0015), 0.0005), (1 / 30_000, (0.015,), 0.0005), (0.01, (0.001,), 0.001)])
def test_the_controller_runs_as_stated_and_meets_every_sample(stated, steps, period):
    records = [make_record(step * np.arange(3000)) for step in steps]
    controller = Controller(law="pd", kp=[1.0, 1.0], kd=[1.0, 1.0], sample_time=stated)
    assert controller_period(controller, records) == pytest.approx(period, rel=1e-3)


def test_between_the_samples_of_a_slow_log_a_command_is_held_or_follows_a_curve():
    slow = make_record(keep=np.arange(0, 3000, 20))
    filled = between_samples(slow, 20)
    assert len(filled) == 3000 and filled.sample_time == pytest.approx(PERIOD)
    np.testing.assert_array_equal(np.flatnonzero(filled.valid), np.arange(0, 3000, 20))
    inside = slice(100, 2900)
    np.testing.assert_allclose(filled.pe[inside], 3.0 * COURSE[inside], atol=2e-4)
    np.testing.assert_array_equal(filled.qd, STEPS)


def test_a_ramp_between_long_rests_is_no_held_signal():
    ramp = np.clip(0.3 * (TIME - 1.0), 0.0, 0.15)  # rests for five sixths of the time
    slow = make_record(qd=np.stack([ramp, ramp], axis=1), keep=np.arange(0, 3000, 20))
    filled = between_samples(slow, 20)
    np.testing.assert_allclose(filled.qd[100:2900, 0], ramp[100:2900], atol=2e-3)


def test_a_log_that_is_mostly_holes_is_refused_with_the_place_of_the_first():
    q = COURSE.copy()
    q[1000:] = np.nan
    with pytest.raises(RecordError, match="2000 of 3000 samples cannot be used, first at 1 s"):
        on_ticks(make_record(q=q), PERIOD)
