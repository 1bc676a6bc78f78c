"""Filters as machine code give what scipy gives."""

import sys

import numpy as np
import pytest
from scipy import signal

from clie_blocks import linear_filters
from clie_blocks.linear_filters import lfilter

FILTERS = [signal.butter(4, 0.1), ([1.0, 0.2, 0.1], [1.0]), ([1.0], [2.0, -0.5, 0.1]),
           ([3.0], [2.0]), (np.sin(np.arange(21.0)), [1.0]), ([1.0, 0.5], [1.0, -0.3, 0.1, 0.2])]


@pytest.mark.parametrize("shape", [(400,), (0,), (1, 1), (60, 2), (60, 3, 2), (60, 30), (60, 0)])
@pytest.mark.parametrize("b, a", FILTERS)
def test_signals_and_tables_are_filtered_as_by_scipy(b, a, shape):
    x = np.random.default_rng(0).standard_normal(shape)
    expected = signal.lfilter(b, a, x, axis=0) if x.size else x
    np.testing.assert_allclose(lfilter(b, a, x), expected, rtol=1e-12, atol=1e-13)


def test_reversed_and_whole_numbers_are_signals_too():
    x = np.arange(50)[::-1]
    b, a = FILTERS[0]
    np.testing.assert_allclose(lfilter(b, a, x), signal.lfilter(b, a, x), rtol=1e-12)


def test_without_machine_code_scipy_filters(monkeypatch):
    linear_filters._kernel.cache_clear()
    monkeypatch.setitem(sys.modules, "clie_blocks.compiled.codegen.machine", None)
    x = np.random.default_rng(0).standard_normal((50, 3))
    found = lfilter(*FILTERS[0], x)
    linear_filters._kernel.cache_clear()
    np.testing.assert_array_equal(found, signal.lfilter(*FILTERS[0], x, axis=0))
