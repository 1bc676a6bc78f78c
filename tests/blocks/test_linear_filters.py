"""Linear filters give what scipy.signal gives, which they do not import."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import linalg, signal

from clie_blocks import linear_filters
from clie_blocks.errors import ClieError
from clie_blocks.linear_filters import (
    butterworth,
    frequency_response,
    high_pass,
    lfilter,
    low_pass,
    zero_order_hold,
)

FILTERS = [signal.butter(4, 0.1), ([1.0, 0.2, 0.1], [1.0]), ([1.0], [2.0, -0.5, 0.1]),
           ([3.0], [2.0]), (np.sin(np.arange(21.0)), [1.0]), ([1.0, 0.5], [1.0, -0.3, 0.1, 0.2])]
CORNERS = [(4, 60.0, 1000.0), (2, 20.0, 1000.0), (4, 60.0, 4000.0), (2, 20.0, 100.0),
           (4, 20.0, 100.0), (4, 5.0, 1000.0), (8, 20.0, 100.0)]


def random_walk(*shape):
    return np.cumsum(np.random.default_rng(0).standard_normal(shape), axis=0)


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
    linear_filters._recursion.cache_clear()
    monkeypatch.setitem(sys.modules, "clie_blocks.compiled.codegen.machine", None)
    x = np.random.default_rng(0).standard_normal((50, 3))
    filtered = lfilter(*FILTERS[0], x)
    linear_filters._recursion.cache_clear()
    np.testing.assert_array_equal(filtered, signal.lfilter(*FILTERS[0], x, axis=0))


@pytest.mark.parametrize("order, corner, rate", CORNERS)
@pytest.mark.parametrize("passes, band", [(high_pass, "high"), (low_pass, "low")])
def test_zero_phase_filters_are_those_of_scipy(passes, band, order, corner, rate):
    x = random_walk(3000, 2)
    sections = signal.butter(order, corner, band, fs=rate, output="sos")
    for each in (x, x[:, 0]):
        expected = signal.sosfiltfilt(sections, each, axis=0)
        np.testing.assert_allclose(passes(each, order, corner, rate), expected, rtol=0.0,
                                   atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("order, corner, rate", CORNERS)
@pytest.mark.parametrize("band", ["high", "low"])
def test_sections_are_the_poles_and_gains_of_scipy(order, corner, rate, band):
    grid = np.linspace(0.01, 3.14, 50)
    response = np.prod([frequency_response(b, a, grid)
                        for b, a in butterworth(order, corner, rate, band)], axis=0)
    expected = signal.sosfreqz(signal.butter(order, corner, band, fs=rate, output="sos"), grid)[1]
    np.testing.assert_allclose(response, expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("band, ends", [("high", (0.0, 1.0)), ("low", (1.0, 0.0))])
def test_butterworth_halves_the_power_at_its_corner(band, ends):
    gains = np.prod([np.abs(frequency_response(b, a, [1e-9, 0.12 * np.pi, np.pi]))
                     for b, a in butterworth(4, 60.0, 1000.0, band)], axis=0)
    np.testing.assert_allclose(gains, [ends[0], np.sqrt(0.5), ends[1]], atol=1e-9)


def test_a_signal_shorter_than_its_extension_is_refused():
    assert len(low_pass(np.ones(16), 4, 20.0, 1000.0)) == 16
    with pytest.raises(ClieError, match="15 samples is too short .* more than 15"):
        low_pass(np.ones(15), 4, 20.0, 1000.0)


def test_responses_are_those_of_scipy():
    b, a = signal.butter(3, [0.1, 0.3], "band")
    grid = np.linspace(0.01, np.pi, 50)
    for bottom in (a, [2.0]):
        np.testing.assert_allclose(frequency_response(b, bottom, grid),
                                   signal.freqz(b, bottom, grid)[1], rtol=1e-9)


@pytest.mark.parametrize("frequency, damping_ratio, step", [
    (15.0, 1.0, 0.002), (40.0, 0.2, 0.002), (300.0, 5.0, 0.002), (1.0, 0.5, 1.0), (0.0, 0.0, 0.1)])
def test_a_held_input_moves_a_second_order_lag_as_in_scipy(frequency, damping_ratio, step):
    a = np.array([[0.0, 1.0], [-frequency**2, -2.0 * damping_ratio * frequency]])
    b = np.array([[0.0], [max(frequency, 1.0)**2]])
    expected = signal.cont2discrete((a, b, np.eye(2), 0 * b), step, "zoh")
    for mine, theirs in zip(zero_order_hold(a, b, step), expected):
        np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-12 * np.max(np.abs(theirs)))


def test_a_held_input_without_poles_at_zero_has_a_closed_form():
    a, b = random_walk(4, 4) - 5.0 * np.eye(4), random_walk(4, 2)
    transition, drive = zero_order_hold(a, b, 0.03)
    np.testing.assert_allclose(transition, linalg.expm(0.03 * a), rtol=1e-12)
    np.testing.assert_allclose(drive, np.linalg.solve(a, (transition - np.eye(4)) @ b), rtol=1e-11)


def test_filtering_imports_no_scipy():
    code = ("import sys, numpy as np\n"
            "from clie_blocks.linear_filters import high_pass, low_pass, zero_order_hold\n"
            "high_pass(low_pass(np.ones(50), 4, 0.1, 1.0), 2, 0.1, 1.0)\n"
            "zero_order_hold(np.eye(2), np.eye(2), 0.1)\n"
            "assert not [name for name in sys.modules if name.split('.')[0] == 'scipy']")
    subprocess.run([sys.executable, "-c", code], check=True)
