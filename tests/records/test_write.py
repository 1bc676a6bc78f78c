"""Writing and reading back is the identity, bit for bit."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.records import read_record, write_record
from clie_blocks.analysis.records.model import SIGNALS, Record
from clie_blocks.errors import RecordError

NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=True)


@st.composite
def records(draw):
    n, samples = draw(st.integers(1, 3)), draw(st.integers(2, 6))
    signals = draw(st.sets(st.sampled_from([name for name in SIGNALS if name != "q"])))
    values = st.lists(st.lists(NUMBERS, min_size=n, max_size=n), min_size=samples,
                      max_size=samples)
    channels = {name: np.array(draw(values)) for name in sorted({"q", *signals})}
    names = [f"joint{k + 1}" for k in range(n)] if draw(st.booleans()) else ["elbow", "wrist 2",
                                                                            "a-b"][:n]
    if draw(st.booleans()):
        channels["q"][0, 0] = np.nan
    return Record(np.arange(samples) * draw(st.sampled_from([0.001, 0.0123])), joints=names,
                  units={"q": draw(st.sampled_from(["rad", "m"])),
                         "u": draw(st.sampled_from(["N m", "V", "duty"]))}, **channels)


@settings(max_examples=60, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(record=records(), ending=st.sampled_from([".csv", ".csv.gz"]))
def test_reading_what_was_written(record, ending, tmp_path):
    found = read_record(write_record(record, tmp_path / f"log{ending}"))
    assert found.signals == record.signals
    for name in ("time", "valid", *record.signals):
        np.testing.assert_array_equal(getattr(found, name), getattr(record, name))
    assert found.joints == record.joints
    for name in record.signals:
        assert found.units[name] == record.units[name]


def test_a_mask_survives(tmp_path):
    record = Record([0, 0.1, 0.2], [1, 2, 3], valid=[True, False, True])
    assert read_record(write_record(record, tmp_path / "a.csv")).valid.tolist() == [True, False,
                                                                                   True]


def test_same_record_same_bytes(tmp_path):
    record = Record([0, 0.1], [1, 2])
    one, two = (write_record(record, tmp_path / name).read_bytes() for name in ("a.csv.gz",
                                                                                "b.csv.gz"))
    assert one == two


def test_what_cannot_be_written(tmp_path):
    with pytest.raises(RecordError, match="must end in .csv"):
        write_record(Record([0, 1], [1, 2]), tmp_path / "a.txt")
    with pytest.raises(RecordError, match="cannot stand in a CSV header"):
        write_record(Record([0, 1], [1, 2], joints=("a,b",)), tmp_path / "a.csv")
