"""Controller and sensor: each against the law or the filter that it stands for."""

import numpy as np
import pytest
from effect_runs import block_response, frequency_response, one_joint, run_loop

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects

KP, KD = 10.0, 5.0


def loop(*effects, kp=KP, kd=KD, plant=None):
    return with_effects(joint_loop(plant or one_joint(), [kp], [kd]), list(effects))


def follow(diagram, q_d, duration=6.0):
    return compile_diagram(diagram).run(duration, 1e-3, "ode4", {
        "q_d": (lambda t: np.array([q_d(t)])) if callable(q_d) else [q_d], "pe": [0.0]})


def test_a_mismatched_filter_is_the_true_one_over_the_stated_one():
    w = np.logspace(0, 4, 9)
    stated, true = 300.0, 180.0
    response = frequency_response(
        LIBRARY["velocity_filter_mismatch"](error=true / stated - 1, corner=stated), w)
    ratio = (true / (1j * w + true)) / (stated / (1j * w + stated))
    np.testing.assert_allclose(response, ratio, rtol=1e-6)


@pytest.mark.parametrize("factor", [1.1, 57.29577951308232, 1 / 57.29577951308232])
def test_a_gain_error_is_a_law_with_other_gains(factor):
    wrong = loop(LIBRARY["gain_error"](kp_error=factor - 1, kd_error=0.2))
    other = loop(kp=factor * KP, kd=1.2 * KD)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x, u = rng.normal(size=2), rng.normal(size=2)
        np.testing.assert_allclose(wrong.dynamics(0, x, u), other.dynamics(0, x, u), rtol=1e-11)


def test_a_law_on_the_velocity_error_has_no_lag_behind_a_ramp():
    a, b = 2.0, 0.5
    lag = {}
    for share in (0.0, 1.0):
        effects = [LIBRARY["control_law_form"](share=share)]
        response = follow(loop(*effects, plant=one_joint(a=a, b=b)), lambda t: 0.4 * t, 12.0)
        lag[share] = 0.4 * response.time[-1] - response.outputs[0].ravel()[-1]
    assert lag[0.0] == pytest.approx(0.4 * (KD + a / b) / KP, rel=1e-4)
    assert lag[1.0] == pytest.approx(0.4 * (a / b) / KP, rel=1e-4)


def test_a_hidden_integral_leaves_no_error_under_load():
    loaded = one_joint(d=0.6)
    with_integral = follow(loop(LIBRARY["hidden_integral"](ki=8.0), plant=loaded), 0.5, 30.0)
    assert with_integral.outputs[0].ravel()[-1] == pytest.approx(0.5, abs=1e-6)
    clamped = follow(loop(LIBRARY["hidden_integral"](ki=8.0, clamp=0.2), plant=loaded), 0.5, 30.0)
    load = 0.6 / 0.5
    assert 0.5 - clamped.outputs[0].ravel()[-1] == pytest.approx((load - 0.2) / KP, rel=1e-2)


def test_hidden_compensation_takes_gravity_and_friction_away():
    weighed = [LIBRARY["gravity"](weight=0.8), LIBRARY["coulomb"](level=0.1, width=0.02)]
    known = LIBRARY["hidden_compensation"](weight=0.8, friction=0.1, width=0.02)
    plain, hidden = loop(), loop(*weighed, known)
    np.testing.assert_allclose(
        hidden.dynamics(0, [0.4, 0.1], [0.7, 0.0]), plain.dynamics(0, [0.4, 0.1], [0.7, 0.0]),
        rtol=1e-12)


def test_a_position_is_never_off_by_more_than_half_a_count():
    q = np.linspace(-0.1, 0.1, 4001)
    counts = LIBRARY["encoder_quantization"].build.kernel(q, 1.5e-3)
    assert np.max(np.abs(counts - q)) <= 0.75e-3 + 1e-12


def test_an_offset_moves_the_joint_the_other_way():
    q_measured = run_loop(one_joint(LIBRARY["encoder_offset"](offset=0.02)), 0.5, 15.0)
    assert q_measured.outputs[0].ravel()[-1] == pytest.approx(0.5, abs=1e-6)
    assert q_measured.states[0][-1] == pytest.approx(0.48, abs=1e-6)


def test_a_lagging_estimate_leaves_the_position_alone():
    plant = one_joint(LIBRARY["velocity_estimate_lag"](lag=0.02))
    x = np.array([{"plant_q[0]": 0.3, "plant_dq[0]": 2.0}.get(s, 0.5) for s in plant.state_labels])
    np.testing.assert_array_equal(plant.output(0, x, [0.0]), [0.3, 0.5])


@pytest.mark.parametrize(("name", "values", "expected"), [
    ("sensor_gain", {"error": 0.1, "bias": 0.3}, lambda u: 1.1 * u + 0.3),
    ("channel_skew", {"skew": 0.02}, None)])
def test_a_fault_of_the_log_leaves_the_loop_alone(name, values, expected):
    plain, logged = (follow(loop(*effects), lambda t: 0.3 * np.sin(4 * t))
                     for effects in ([], [LIBRARY[name](**values)]))
    np.testing.assert_allclose(logged.outputs[0], plain.outputs[0], atol=1e-12)
    u, u_log = plain.outputs[2].ravel(), logged.outputs[2].ravel()
    if expected is None:
        late = slice(1000, None)
        np.testing.assert_allclose(u_log[late], u[980:-20], atol=1e-6)
    else:
        np.testing.assert_allclose(u_log, expected(u), atol=1e-12)


def test_a_quantized_position_reaches_a_velocity_filter_as_spikes():
    t, y = block_response(LIBRARY["encoder_quantization"](resolution=1e-3),
                          {"q": lambda t: 0.1 * t}, 1.0, 1e-3)
    jumps = np.diff(y[0])
    assert set(np.round(jumps / 1e-3)) == {0.0, 1.0}
