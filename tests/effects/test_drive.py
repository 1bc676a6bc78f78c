"""Drive: describing functions, energy, thermal and electrical closed forms."""

import numpy as np
import pytest
from effect_runs import (
    block_response,
    first_harmonic,
    frequency_response,
    one_joint,
    run_loop,
    run_plant,
)
from scipy.integrate import solve_ivp

from clie_blocks.effects import LIBRARY

W = 2 * np.pi  # one period per second
UNDAMPED = {"a": 1e-9, "b": 1.0}


def gain_of(setting, amplitude):
    t, y = block_response(setting, {"u": lambda t: amplitude * np.sin(W * t)}, 1.0)
    return first_harmonic(t, y[0], W) / amplitude


def saturation_gain(share):
    """Describing function of a unit saturation at the amplitude 1/share."""
    return 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2))


@pytest.mark.parametrize("amplitude", [1.5, 3.0, 12.0])
def test_saturation_has_its_describing_function(amplitude):
    gain = gain_of(LIBRARY["actuator_saturation"](limit=1.2), amplitude)
    assert gain == pytest.approx(saturation_gain(1.2 / amplitude), abs=1e-6)


@pytest.mark.parametrize("amplitude", [0.5, 1.0, 4.0])
def test_dead_zone_has_its_describing_function(amplitude):
    gain = gain_of(LIBRARY["dead_zone"](width=0.4), amplitude)
    assert gain == pytest.approx(1 - saturation_gain(0.4 / amplitude), abs=1e-6)


def test_a_jumping_dead_zone_adds_a_relay():
    share, amplitude = 0.25, 1.6
    gain = gain_of(LIBRARY["dead_zone"](width=0.4, jump=1.0), amplitude)
    relay = 4 * share / np.pi * np.sqrt(1 - share**2)
    # the two jumps are met within a step of 1e-4 s
    assert gain == pytest.approx(1 - saturation_gain(share) + relay, abs=5e-4)


def test_a_dead_zone_leaves_its_width_over_kp_at_rest():
    plant = one_joint(LIBRARY["dead_zone"](width=0.5))
    q = run_loop(plant, 1.0, 30.0).outputs[0]
    assert abs(1.0 - q[-1]) == pytest.approx(0.5 / 10, rel=1e-6)


def test_a_saturated_drive_gives_its_limit_times_the_way():
    plant = one_joint(LIBRARY["actuator_saturation"](limit=2.0), **UNDAMPED)
    _, q, dq = run_plant(plant, 50.0, 1.0)
    np.testing.assert_allclose(0.5 * dq**2, 2.0 * q, rtol=1e-6, atol=1e-9)


def test_the_torque_speed_envelope_ends_at_the_no_load_speed():
    plant = one_joint(LIBRARY["torque_speed_limit"](peak=4.0, droop=0.5), **UNDAMPED)
    t, _, dq = run_plant(plant, 100.0, 4.0)
    np.testing.assert_allclose(dq, 2.0 * (1 - np.exp(-4.0 * 0.5 * t)), atol=1e-8)


def test_the_envelope_brakes_with_full_torque():
    torque = LIBRARY["torque_speed_limit"].build.kernel
    np.testing.assert_allclose(
        torque(np.array([9.0, -9.0, 9.0, -9.0]), np.array([1.0, 1.0, -1.0, -1.0]), 4.0, 0.5),
        [2.0, -4.0, 4.0, -2.0])


@pytest.mark.parametrize(("name", "key", "signal"), [
    ("actuator_lag", "lag", "u"), ("velocity_estimate_lag", "lag", "dq")])
def test_lags_are_first_order(name, key, signal):
    w = np.logspace(0, 4, 9)
    block = LIBRARY[name](**{key: 0.01})
    assert block.block(1).input_labels == [f"{signal}[0]"]
    np.testing.assert_allclose(frequency_response(block, w), 1 / (1 + 0.01j * w), rtol=1e-6)


@pytest.mark.parametrize(("name", "values", "extra"), [
    ("torque_ripple", {"sine": 0.06, "cosine": -0.08}, {}),
    ("commutation_ripple", {"sine": 0.02, "cosine": 0.0}, {"u": 5.0}),
    ("gear_mesh_ripple", {"sine": 0.03, "cosine": 0.04}, {"u": -2.0})])
def test_torque_ripple_is_a_line_at_order_times_speed(name, values, extra):
    speed, cycles, duration = 0.5, 40, 8.0
    order = 2 * np.pi * cycles / (duration * speed)
    setting = LIBRARY[name](order=order, **values)
    _, y = block_response(setting, {"q": lambda t: speed * t, **extra}, duration, 1e-3)
    lines = 2 * np.abs(np.fft.rfft(y[0][:-1] - np.mean(y[0][:-1]))) / (y.shape[1] - 1)
    assert lines[cycles] == pytest.approx(0.1, rel=1e-9)
    assert np.max(np.delete(lines, cycles)) < 1e-9


def test_commutation_ripple_grows_with_the_torque():
    torque = LIBRARY["commutation_ripple"].build.kernel
    np.testing.assert_allclose(
        torque(np.array([0.0, 10.0]), np.pi / 2, sine=0.02, cosine=0.5, order=1.0), [0.0, 10.2])


def test_a_motor_fades_as_it_warms_up():
    setting = LIBRARY["motor_heating"](heating=5.0, time_constant=20.0, fade=2e-3)
    t, y = block_response(setting, {"u": 3.0}, 60.0, 0.01)

    def warm_up(_: float, rise: np.ndarray) -> np.ndarray:  # a winding behind a voltage
        return (5.0 * 3.0 * 3.0 / (1 + 2e-3 * rise) - rise) / 20.0

    rise = solve_ivp(warm_up, (0.0, 60.0), [0.0], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    np.testing.assert_allclose(y[0], 3.0 / (1 + 2e-3 * rise), rtol=1e-7)


def test_a_hot_motor_rests_where_its_loss_balances_its_cooling():
    heating, fade, torque = 5.0, 2e-3, 30.0
    setting = LIBRARY["motor_heating"](heating=heating, time_constant=1.0, fade=fade)
    _, y = block_response(setting, {"u": torque}, 60.0, 0.01)
    rise = (np.sqrt(1 + 4 * fade * heating * torque**2) - 1) / (2 * fade)
    assert y[0, -1] == pytest.approx(torque / (1 + fade * rise), rel=1e-9)


def test_back_emf_is_viscous_damping_of_a_powered_joint():
    damped = one_joint(LIBRARY["back_emf"](damping=0.3))
    viscous = one_joint(LIBRARY["viscous"](extra=0.3))
    np.testing.assert_allclose(damped.dynamics(0, [0.2, 1.5], [0.7]),
                               viscous.dynamics(0, [0.2, 1.5], [0.7]), rtol=1e-14)


def test_the_supply_sags_under_all_joints():
    torque = LIBRARY["supply_sag"].build.kernel
    np.testing.assert_allclose(torque(np.array([[5.0, 0.0], [5.0, -5.0], [60.0, 0.0]]), 0.02),
                               [[4.5, 0.0], [4.0, -4.0], [0.0, 0.0]])


def test_a_stepped_torque_is_never_off_by_more_than_half_a_step():
    torque = LIBRARY["torque_quantization"].build.kernel
    u = np.linspace(-1, 1, 4001)
    steps = torque(u, 0.05)
    assert np.max(np.abs(steps - u)) <= 0.025 + 1e-12
    np.testing.assert_allclose(steps / 0.05, np.rint(steps / 0.05), atol=1e-9)


def test_a_slewed_set_point_has_one_slope_for_every_step():
    setting = LIBRARY["setpoint_slew"](speed=0.5)
    for height in (0.5, 2.0):
        t, y = block_response(setting, {"q_d": height}, 1.5 * height / 0.5, 1e-3)
        rising = (t > 0.05) & (y[0] < 0.95 * height)
        np.testing.assert_allclose(np.diff(y[0][rising]) / 1e-3, 0.5, rtol=1e-6)
        assert y[0][-1] == pytest.approx(height, abs=1e-9)


def test_a_torque_gain_error_scales_the_torque():
    plain, scaled = one_joint(), one_joint(LIBRARY["torque_gain_error"](error=0.1))
    np.testing.assert_allclose(scaled.dynamics(0, [0.1, 0.2], [2.0]),
                               plain.dynamics(0, [0.1, 0.2], [2.2]), rtol=1e-14)
