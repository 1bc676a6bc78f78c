"""Arrays that map a file give their memory back without losing a value."""

import numpy as np
import pytest

from clie_blocks.analysis.records.table import drop_pages


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "values"
    np.arange(3000.0).tofile(path)
    return path


def test_pages_that_were_dropped_are_read_again(file):
    array = np.asarray(np.memmap(file, float, "r", shape=(1000, 3), order="F"))[:, 1:]
    before = array.copy()
    drop_pages(array)
    np.testing.assert_array_equal(array, before)


def test_what_was_written_into_a_map_stays(file):
    array = np.asarray(np.memmap(file, float, "c"))
    array[:2] = -1.0
    drop_pages(array)
    np.testing.assert_array_equal(array[:3], [-1.0, -1.0, 2.0])


def test_an_array_in_memory_is_left_alone():
    drop_pages(np.ones(3))
