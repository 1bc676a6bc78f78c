"""Sine and cosine of lanes in line, against exact ones and the C library."""

import control as ct
import numpy as np
import pytest
from mpmath import mp

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.codegen import sine_cosine
from clie_blocks.compiled.codegen.lane_layout import lanes

EXACT = 400  # bits, enough for multiples of pi/2 that leave almost nothing
MOST = 1.5  # units in the last place
needs_fused = pytest.mark.skipif(not sine_cosine.is_in_line(8),
                                 reason="the processor has no fused multiplication")


@pytest.fixture(scope="module")
def program():
    block = ct.nlsys(None, lambda t, x, u, params: np.stack(
        [np.sin(params["angle"]), np.cos(params["angle"])]), inputs=["u"], name="circle",
        outputs=["sine", "cosine"], params={"angle": 1.0})
    return compile_diagram(block)


def on_circle(program, angles):
    batch = program.batch(1e-3, step=1e-3, inputs={"u": 0.0}, params={"angle": angles}, threads=1)
    return batch.outputs[:, :, 0].T


def units_off(values, function, angles):
    with mp.workprec(EXACT):
        exact = [function(mp.mpf(float(angle))) for angle in angles]
        return max(float(abs(mp.mpf(float(value)) - one)) / np.spacing(abs(float(one)))
                   for value, one in zip(values, exact))


@needs_fused
@pytest.mark.parametrize("angles", [
    np.random.default_rng(0).uniform(-10.0, 10.0, 2000),
    np.random.default_rng(1).uniform(-sine_cosine.LIMIT, sine_cosine.LIMIT, 2000),
    np.pi / 2 * np.random.default_rng(2).integers(-600_000, 600_000, 500),
    np.pi / 2 * np.arange(-32.0, 32.0),
    10.0 ** np.random.default_rng(3).uniform(-300.0, 6.0, 500)],
    ids=["usual", "large", "near multiples", "quarter turns", "small"])
def test_both_are_exact_to_the_last_place(program, angles):
    sine, cosine = on_circle(program, angles)
    assert units_off(sine, mp.sin, angles) < MOST
    assert units_off(cosine, mp.cos, angles) < MOST


def test_angles_far_away_go_to_the_library(program):
    angles = np.array([1e7, -1e300, np.inf, -np.inf, np.nan, 0.5, 2e6, -1e17])
    with np.errstate(invalid="ignore"):
        expected = np.sin(angles), np.cos(angles)
    np.testing.assert_allclose(on_circle(program, angles), expected, rtol=1e-15)


def test_zero_keeps_its_sign(program):
    sine, cosine = on_circle(program, np.array([-0.0, 0.0] * 8))
    np.testing.assert_array_equal(np.signbit(sine), [True, False] * 8)
    np.testing.assert_array_equal(cosine, 1.0)


def test_lanes_lie_on_the_circle_whatever_stands_beside_them(program):
    """One lane far away makes all of them take the other way."""
    angles = np.linspace(-3.0, 3.0, 16)
    near = on_circle(program, angles)
    beside = on_circle(program, np.where(np.arange(16) % 8 == 3, 1e9, angles))
    kept = np.arange(16) % 8 != 3
    np.testing.assert_allclose(beside[:, kept], near[:, kept], rtol=1e-15)
    np.testing.assert_allclose(np.hypot(*near), 1.0, rtol=4e-16)


@needs_fused
def test_one_reduction_serves_both():
    block = ct.nlsys(lambda t, x, u, params: params["a"] * np.sin(x) + np.cos(x), None,
                     inputs=["u"], outputs=["y"], states=1, params={"a": 1.0}, name="turning")
    program = compile_diagram(block)
    memory = lanes(8, 1, len(program.signals), np.ones(1, bool))
    text = program.machine_text([], memory)
    assert text.count("call {<8 x double>, <8 x double>} @sine_and_cosine.8") == 1
