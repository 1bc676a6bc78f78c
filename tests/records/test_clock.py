"""The clock of a log: its unit, its gaps, its repeats; nothing is filled in."""

import numpy as np
import pytest

from clie_blocks.analysis.records import read_record
from clie_blocks.analysis.records.clock import (
    repeated_stamps,
    seconds,
    segments,
    with_resets_counted_on,
)
from clie_blocks.errors import RecordError

STEPS = np.arange(50)


@pytest.mark.parametrize("stamps, sample_time, factor", [
    (STEPS * 0.001, None, 1), (STEPS * 0.02, None, 1),
    (STEPS * 1e6, 1e-3, 1e-9), (STEPS * 1e3, 1e-3, 1e-6), (STEPS * 1.0, 1e-3, 1e-3),
    (STEPS * 0.5, 5e-4, 1e-3),
    (1.7e9 + STEPS * 0.01, None, 1), (1.7e12 + STEPS * 10.0, None, 1e-3),
    (1.7e15 + STEPS * 1e4, None, 1e-6), (1.7e18 + STEPS * 1e7, None, 1e-9),
])
def test_the_unit_of_the_clock_is_found_when_only_one_fits(stamps, sample_time, factor):
    time, notes = seconds(stamps, None, sample_time, "log")
    origin = stamps[0] if stamps[0] > 1e8 else 0.0
    np.testing.assert_allclose(time, (stamps - origin) * factor, atol=1e-12)
    assert bool(notes) == (factor != 1 or origin != 0)


def test_a_sample_number_is_no_clock():
    with pytest.raises(RecordError, match="step of 1 does not decide it"):
        seconds(STEPS * 1.0, None, None, "log")


def test_a_unit_that_cannot_be_told_is_asked_for():
    with pytest.raises(RecordError, match=r"step of 1000 does not decide it .*--time-unit us"):
        seconds(STEPS * 1000.0, None, None, "log")
    time, _ = seconds(STEPS * 1000.0, "us", None, "log")
    np.testing.assert_allclose(time, STEPS * 1e-3)
    with pytest.raises(RecordError, match="unit 'usecs' is not known; did you mean 'us'"):
        seconds(STEPS * 1000.0, "usecs", None, "log")


def test_gaps_and_resets_split():
    time = np.concatenate([STEPS, STEPS + 60, STEPS]) * 0.01
    ranges, notes = segments(time)
    assert ranges == [(0, 50), (50, 100), (100, 150)]
    assert any("leaps 1 times by more than 3" in note for note in notes)
    assert any("backwards 1 times" in note for note in notes)
    assert segments(STEPS * 0.01) == ([(0, 50)], [])
    assert segments(np.zeros(1)) == ([(0, 1)], [])


def reset(record, at):
    time = record.time.copy()
    time[at:] -= time[at]
    return record.replace(time=time, segments=segments(time)[0])


def without(record, start, stop):
    kept = np.ones(len(record), bool)
    kept[start:stop] = False
    return record.rows(kept)


def test_a_clock_that_was_reset_counts_on_where_the_signals_do(clean):
    mended = with_resets_counted_on(reset(reset(clean, 7000), 3000))
    np.testing.assert_allclose(mended.time, clean.time, atol=1e-9)
    assert mended.segments == ((0, len(clean)),)
    assert "counted on" in mended.decisions[-1]
    assert with_resets_counted_on(clean) is clean


@pytest.mark.parametrize("lost", [1, 40])
def test_a_clock_that_was_reset_where_rows_were_lost_cuts_the_log(clean, lost):
    cut = reset(without(clean, 5000, 5000 + lost), 5000)
    assert with_resets_counted_on(cut) is cut
    both = with_resets_counted_on(reset(cut, 8000))
    assert both.segments == ((0, 5000), (5000, len(cut)))


def test_of_repeated_stamps_the_last_counts():
    time = STEPS * 0.01
    rare = np.insert(np.tile(time, 4) + np.repeat([0, 1, 2, 3], 50), 10, 0.09)
    twin, notes = repeated_stamps(rare)
    assert np.flatnonzero(twin).tolist() == [9]
    assert "1 stamps repeat" in notes[0]
    coarse, notes = repeated_stamps(np.repeat(time, 4))
    assert not coarse.any()
    assert "coarser" in notes[0]


def test_gaps_in_a_log_split_its_record(tmp_path):
    rows = [f"{t},{t}" for t in (0, 0.01, 0.02, 0.5, 0.51, 0.52)]
    (tmp_path / "log.csv").write_text("\n".join(["time,q1", *rows]))
    record = read_record(tmp_path / "log.csv")
    assert record.segments == ((0, 3), (3, 6))
    assert len(record) == 6
    assert any("nothing was filled in" in sentence for sentence in record.decisions)
