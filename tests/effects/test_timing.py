"""Timing: phase of the delays, the exact delay line, beats and holds."""

import control as ct
import numpy as np
import pytest
from effect_runs import block_response, frequency_response, one_joint

from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.delay import delay_line
from clie_blocks.signals import DiagramError

DELAY = 0.01


@pytest.mark.parametrize(("name", "key"), [("time_delay", "delay"), ("channel_skew", "skew"),
                                          ("setpoint_delay", "delay")])
@pytest.mark.parametrize(("angle", "error"), [(1.0, 1e-9), (4.0, 1e-4), (5.0, 1e-3), (6.0, 5e-3)])
def test_a_delay_has_its_phase_and_no_gain(name, key, angle, error):
    w = np.array([angle / DELAY])
    response = frequency_response(LIBRARY[name](**{key: DELAY}), w)
    np.testing.assert_allclose(response, np.exp(-1j * w * DELAY), atol=error)


def test_a_delayed_sine_is_the_sine_of_before():
    t, y = block_response(LIBRARY["time_delay"](delay=0.02), {"u": lambda t: np.sin(30 * t)}, 1.0)
    late = t > 0.3
    np.testing.assert_allclose(y[0][late], np.sin(30 * (t - 0.02))[late], atol=1e-6)


def test_a_late_measurement_is_position_and_velocity_of_before():
    setting = LIBRARY["in_loop_delay"](delay=0.02)
    signal = {"q": lambda t: 0.7 + np.sin(9 * t), "dq": lambda t: 9 * np.cos(9 * t)}
    t, y = block_response(setting, signal, 1.0)
    late = t > 0.3
    np.testing.assert_allclose(y[0][late], 0.7 + np.sin(9 * (t - 0.02))[late], atol=1e-6)
    np.testing.assert_allclose(y[1][late], 9 * np.cos(9 * (t - 0.02))[late], atol=1e-5)


def test_a_late_measurement_at_rest_is_right_at_once():
    _, y = block_response(LIBRARY["in_loop_delay"](delay=0.02), {"q": 0.7, "dq": 0.0}, 0.1)
    assert np.all(y[0] == 0.7) and np.all(y[1] == 0.0)


@pytest.mark.parametrize("name", ["time_delay", "in_loop_delay"])
def test_a_delay_in_the_loop_takes_kp_times_itself_from_the_damping(name):
    def damping(kd, *effects):
        plain = joint_loop(one_joint(), [200.0], [kd])
        loop = with_effects(plain, list(effects))
        poles = ct.linearize(loop, np.zeros(loop.nstates), np.zeros(2)).poles()
        return -poles[np.argmin(np.abs(poles))].real

    lost = damping(5.0) - damping(5.0, LIBRARY[name](delay=0.002))
    assert lost == pytest.approx(damping(5.0) - damping(5.0 - 200.0 * 0.002), rel=0.15)


def sampled(line, rows):
    """Output of a discrete block along rows of inputs."""
    x, found = np.zeros(line.nstates), []
    for row in rows:
        found.append(line.output(0.0, x, row))
        x = line.dynamics(0.0, x, row)
    return np.array(found)


def test_a_delay_line_is_exact_and_interpolates_between_samples():
    rows = np.random.default_rng(0).normal(size=(40, 3))
    found = sampled(delay_line([0.005, 0.0, 0.0025], 1e-3), rows)
    np.testing.assert_array_equal(found[5:, 0], rows[:-5, 0])
    np.testing.assert_array_equal(found[:5, 0], np.zeros(5))
    np.testing.assert_array_equal(found[:, 1], rows[:, 1])
    np.testing.assert_allclose(found[3:, 2], (rows[1:-2, 2] + rows[:-3, 2]) / 2, rtol=1e-9)


@pytest.mark.parametrize(("call", "text"), [
    (lambda: delay_line([0.1], 0.0), "the period must be positive"),
    (lambda: delay_line([-0.1], 1e-3), "delay_line: delay must be at least 0")])
def test_a_delay_line_refuses_what_it_cannot_hold(call, text):
    with pytest.raises(DiagramError, match=text):
        call()


def test_beating_ticks_put_lines_beside_the_excitation():
    carrier, beat, spread = 20, 3, 2e-3
    setting = LIBRARY["tick_jitter"](spread=spread, beat=float(beat))
    w = 2 * np.pi * carrier
    _, y = block_response(setting, {"u": lambda t: np.sin(w * t)}, 2.0)
    lap = y[0][10000:20000]
    lines = 2 * np.abs(np.fft.rfft(lap)) / len(lap)
    # u(t - spread frac(beat t)): to first order the saw-tooth's harmonics modulate w spread cos
    side = w * spread / (2 * np.pi)
    assert lines[carrier] == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(lines[[carrier - beat, carrier + beat]], side, rtol=0.15)


def test_lost_packets_hold_the_command():
    setting = LIBRARY["packet_hold"](hold=0.1, interval=0.5)
    t, y = block_response(setting, {"u": lambda t: np.sin(3 * t)}, 1.0)
    held = (t > 0.5 + 1e-6) & (t < 0.6 - 1e-6)
    free = (t > 0.6 + 1e-6) & (t < 1.0 - 1e-6)
    assert np.ptp(y[0][held]) < 1e-12
    assert y[0][held][0] == pytest.approx(np.sin(3 * (0.5 - 5e-4)), abs=1e-3)
    np.testing.assert_array_equal(y[0][free], np.sin(3 * t)[free])
