"""Friction against closed forms: stopping, sticking, creeping, break-away, memory."""

import numpy as np
import pytest
from effect_runs import one_joint, run_loop, run_plant, state_along

from clie_blocks.effects import LIBRARY
from clie_blocks.effects.presliding import presliding_torque

A, B = 2.0, 0.5  # damping over inertia [1/s], one over inertia [1/(kg m^2)]


def test_a_coasting_joint_stops_when_coulomb_friction_says():
    level, speed = 0.4, 3.0
    t, q, dq = run_plant(one_joint(LIBRARY["coulomb"](level=level)), 0.0, 3.0,
                         state={"plant_dq[0]": speed})
    stop = np.log1p(A * speed / (B * level)) / A
    distance = speed / A - B * level / A * stop
    nearly = stop - 2e-3 / (B * level)  # when the speed is 2 mrad/s
    assert t[np.argmax(dq < 2e-3)] == pytest.approx(nearly, abs=2e-3)
    assert q[-1] == pytest.approx(distance, rel=2e-3)


def test_dry_friction_takes_four_levels_over_stiffness_per_swing():
    level, kp = 0.05, 10.0
    loop = run_loop(one_joint(LIBRARY["coulomb"](level=level), a=1e-9), 1.0, 12.0, kp=kp, kd=1e-9)
    error = 1.0 - loop.outputs[0].ravel()
    peaks = np.abs(error[1:-1][(np.abs(error[1:-1]) > np.abs(error[:-2]))
                               & (np.abs(error[1:-1]) >= np.abs(error[2:]))])
    drops = -np.diff(np.concatenate(([1.0], peaks)))
    np.testing.assert_allclose(drops[:6], 2 * level / kp, rtol=0.02)


def test_smoothed_friction_creeps_as_stated():
    level, width, load = 0.4, 1e-3, 0.3
    _, _, dq = run_plant(one_joint(LIBRARY["coulomb"](level=level)), load, 2.0)
    creep = width * np.arctanh((load - A / B * dq[-1]) / level)
    assert dq[-1] == pytest.approx(creep, rel=1e-6)
    rate = 0.1  # a slow ramp up to break-away
    t, q, _ = run_plant(one_joint(LIBRARY["coulomb"](level=level), a=1e-9), lambda t: rate * t,
                        0.9 * level / rate)
    x = 0.9
    area = x * np.arctanh(x) + 0.5 * np.log1p(-(x**2))  # integral of atanh
    assert q[-1] == pytest.approx(width * level / rate * area, rel=0.02)


def test_first_harmonic_of_coulomb_friction_is_that_of_a_relay():
    angle = 2 * np.pi * np.arange(20000) / 20000
    tau = LIBRARY["coulomb"].build.kernel(2.0 * np.cos(angle), level=0.3, width=1e-5)
    assert 2 * np.mean(tau * np.cos(angle)) == pytest.approx(4 * 0.3 / np.pi, rel=1e-4)


def test_stribeck_goes_from_static_to_coulomb_level():
    torque = LIBRARY["stribeck"].build.kernel
    law = {"level": 0.2, "excess": 0.12, "velocity": 0.02, "exponent": 2.0, "width": 1e-6}
    assert torque(1e-4, **law) == pytest.approx(0.32, rel=1e-4)
    assert torque(0.02, **law) == pytest.approx(0.2 * (1 + 0.6 / np.e), rel=1e-6)
    assert torque(-1.0, **law) == pytest.approx(-0.2, rel=1e-12)


def test_stick_slip_of_a_slow_ramp_needs_the_stribeck_effect():
    stuck = {}
    for name, more in (("coulomb", {}), ("stribeck", {"excess": 0.15})):
        plant = one_joint(LIBRARY[name].typical(level=0.3, width=1e-4, **more), a=0.4)
        loop = run_loop(plant, lambda t: 0.02 * t, 60.0, step=5e-4, kp=2.0, kd=1e-3)
        dq = loop.outputs[1].ravel()[len(loop.time) // 2:]
        stuck[name] = np.mean(np.abs(dq) < 1e-3)
    assert stuck["stribeck"] > 0.5 and stuck["coulomb"] < 0.05


@pytest.mark.parametrize("speed", [1e-3, 0.02, 0.1, -0.5])
def test_lugre_settles_on_the_stribeck_curve(speed):
    t = np.arange(0, 0.06, 1.5e-5) / abs(speed)  # 60 mrad
    tau = state_along("presliding", t, np.full_like(t, speed))
    curve = LIBRARY["stribeck"].build.kernel(speed, level=0.05, excess=0.025, velocity=0.02,
                                             exponent=2.0, width=1e-9)
    assert tau[-1] == pytest.approx(curve, rel=1e-3)


def test_presliding_sticks_below_break_away_and_slides_above():
    plant = one_joint(LIBRARY["presliding"].typical(level=0.4, static_ratio=1.5,
                                                    bristle_damping=2.0))
    _, q, dq = run_plant(plant, lambda t: np.minimum(0.1 * t, 0.55), 20.0)
    assert abs(dq[-1]) < 1e-9 and abs(q[-1]) < 5 * 2e-3  # smoothed, it would creep at 1e-3
    assert np.ptp(q[-1000:]) < 1e-9
    _, q, dq = run_plant(plant, lambda t: np.minimum(0.1 * t, 0.65), 20.0)
    assert dq[-1] == pytest.approx((0.65 - 0.4) * B / A, rel=0.02)


def test_break_away_torque_of_a_slow_ramp_is_the_static_one():
    contact = LIBRARY["presliding"].typical(level=0.4, static_ratio=1.5, velocity=0.1)
    plant = one_joint(contact, b=50.0)
    rate = 0.05
    t, _, dq = run_plant(plant, lambda t: rate * t, 14.0)
    assert rate * t[np.argmax(dq > 0.02)] == pytest.approx(0.6, rel=0.02)


def test_only_the_elastic_contact_holds_a_vibrating_load():
    drift = {}
    for elastic in (0.0, 0.8):
        plant = one_joint(LIBRARY["presliding"].typical(level=0.4, static_ratio=1.0,
                                                        elastic=elastic))
        t, q, _ = run_plant(plant, lambda t: 0.15 + 0.12 * np.sin(20 * t), 40.0)
        lap = int(round(2 * np.pi / 20 / (t[1] - t[0])))
        drift[elastic] = np.mean(q[-lap:]) - np.mean(q[len(q) // 2 - lap:len(q) // 2])
    assert drift[0.0] > 2e-3  # LuGre's drift over 20 s, as published
    assert abs(drift[0.8]) < 1e-6


def test_presliding_returns_no_more_than_it_stored():
    """Faster than the contact can follow, a reversal gives back the stored energy exactly."""
    level, reach, fastest = 0.4, 2e-3, 100.0
    z, power, h = reach, 0.0, 1e-6
    for _ in range(20000):
        tau = presliding_torque(z, -5.0, level, 1.0, 1e-4, reach, 0.9, 0.0, fastest)
        power += tau * -5.0 * h
        z -= reach * fastest * h
        if z < 0:
            break
    assert -power == pytest.approx(0.5 * level * reach, rel=1e-3)


def test_dahl_bends_exponentially():
    level, reach, speed = 0.4, 2e-3, 0.01
    t = np.arange(0, 1.0, 1e-4)
    tau = state_along("dahl", t, np.full_like(t, speed), level=level, reach=reach)
    np.testing.assert_allclose(tau, level * (1 - np.exp(-speed * t / reach)), atol=1e-6)


def test_dahl_of_exponent_1_is_presliding_without_damping():
    level, reach = 0.4, 2e-3
    t = np.arange(0, 1.0, 1e-4)
    dq = 0.02 * np.sin(9.0 * t) + 0.01 * np.cos(31.0 * t)
    dahl = state_along("dahl", t, dq, level=level, reach=reach, exponent=1.0)
    presliding = state_along("presliding", t, dq, level=level, reach=reach, static_ratio=1.0,
                             elastic=0.0, bristle_damping=0.0)
    np.testing.assert_allclose(dahl, presliding, rtol=0, atol=1e-9)
    assert np.abs(dahl).max() > 0.8 * level


def test_maxwell_slip_has_its_virgin_curve_and_closes_inner_loops():
    level, reach, step = 0.5, 5e-3, 1e-3
    q = np.concatenate([np.linspace(0, 3e-3, 301), np.linspace(3e-3, 1e-3, 201)[1:],
                        np.linspace(1e-3, 3e-3, 201)[1:]])  # out, back, and out again
    t = step * np.arange(len(q))
    tau = state_along("maxwell_slip", t, np.gradient(q, step), level=level, reach=reach)
    limits = reach * np.arange(1, 6) / 5
    virgin = level / 5 * np.sum(np.minimum(1, q[:301, None] / limits), axis=1)
    np.testing.assert_allclose(tau[:300], virgin[:300], atol=2e-3 * level)
    assert tau[-1] == pytest.approx(tau[300], abs=2e-3 * level)  # return-point memory
    back = tau[300] - level / 5 * np.sum(np.minimum(2, 2e-3 / limits))  # Masing's rule
    assert tau[500] == pytest.approx(back, abs=6e-3 * level)


def test_break_away_grows_with_rest():
    rise, half_time = 0.4, 5.0
    for rest in (1.0, 5.0, 20.0):
        t = np.arange(0, rest + 0.002, 1e-3)
        dq = np.where(t < rest, 0.0, 5e-3)
        tau = state_along("rest_time_breakaway", t, dq, rise=rise, half_time=half_time)
        expected = rise * rest / (rest + half_time) * np.exp(-(5e-3 / 0.02) ** 2)
        assert tau[-1] == pytest.approx(expected * np.tanh(5.0), rel=2e-3)


def test_warm_joint_has_the_whole_change_of_friction():
    numbers = {"viscous_change": -0.3, "coulomb_change": 0.1, "level": 0.0,
               "time_constant": 20.0, "since": 0.0, "width": 1e-3}
    early, late = (LIBRARY["friction_drift"].build.kernel(t, 2.0, **numbers)
                   for t in (0.0, 400.0))
    assert early == 0.0 and late == pytest.approx(-0.3 * 2.0 + 0.1, rel=1e-6)


def test_gear_losses_follow_the_power():
    loss = LIBRARY["directional_efficiency"].build.kernel
    lifting = loss(0.5, 2.0, driving=0.1, backdriving=0.3, width=1e-3)
    lowering = loss(-0.5, 2.0, driving=0.1, backdriving=0.3, width=1e-3)
    assert lifting == pytest.approx(0.2) and lowering == pytest.approx(-0.6)
    loaded = LIBRARY["load_dependent_friction"].build.kernel
    assert loaded(-0.5, -2.0, level=0.0, share=0.1, width=1e-3) == pytest.approx(-0.2)
