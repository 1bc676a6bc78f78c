"""What the diagnosis fits is what the catalogue describes: each cause against its effect's law."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import solve_ivp

from clie_blocks import effects
from clie_blocks.analysis.gap.causes import (
    CAUSES,
    drive,
    friction,
    transmission,
)
from clie_blocks.analysis.gap.causes.cause import waves_over_travel
from clie_blocks.analysis.gap.causes.vocabulary import FOUND_BY_REPLAY
from clie_blocks.effects import (
    backlash,
    joint_elasticity,
    lag,
    presliding,
    stiffening_elasticity,
    torsional_hysteresis,
)
from clie_blocks.robot_loop import dynamics
from clie_blocks.robot_loop.dynamics import State

N = 3
STEEP = 1e-9  # rad/s: the smoothed sign of the catalogue is a sign
signed = arrays(float, N, elements=st.floats(-5.0, 5.0))
moving = signed.map(lambda v: np.where(np.abs(v) < 1e-3, 1e-3, v))
positive = arrays(float, N, elements=st.floats(1e-3, 5.0))


def state(q=0.0, dq=0.0, u=0.0, t=0.0, h=1e-3):
    return State(np.broadcast_to(q, N), np.broadcast_to(dq, N), np.broadcast_to(u, N), t, h,
                 None, np.ones(N))


def dry(cause, s, p):
    """Torque against the motion: the side that the motion is on, with its sign."""
    (forward, backward), _ = cause.pieces[0].act(s, [], p)
    return np.where(s.dq > 0, forward, -np.asarray(backward))


def waves(sine, cosine):
    """Level and phase of a wave given by sine and cosine."""
    return np.hypot(sine, cosine), np.arctan2(cosine, sine)


def test_every_effect_that_is_searched_for_is_in_the_catalogue():
    named = {cause.name for cause in CAUSES} | set(FOUND_BY_REPLAY)
    assert named <= set(effects.LIBRARY)


FROM_THE_CATALOGUE = [cause for cause in CAUSES if hasattr(cause.pieces[0].act, "function")]


@pytest.mark.parametrize("cause", FROM_THE_CATALOGUE, ids=lambda cause: cause.key)
def test_a_cause_has_the_parameters_of_its_effect(cause):
    parameters = {p.name: p for p in effects.LIBRARY[cause.name].parameters}
    for number in cause.numbers:
        if number.nuisance:  # how the joint is built
            continue
        of_effect = parameters[number.name]
        assert (number.unit, number.neutral) == (of_effect.unit, of_effect.neutral)
        assert of_effect.lower <= number.lower < number.upper <= of_effect.upper


@given(moving, signed, st.sampled_from(["coulomb", "stribeck", "asymmetric_coulomb",
                                        "load_dependent_friction"]), st.data())
def test_the_impulse_of_a_moving_joint_is_the_smoothed_torque(dq, u, name, data):
    cause = next(one for one in CAUSES if one.name == name)
    p = {number.name: data.draw(positive) for number in cause.numbers}
    kernel = effects.LIBRARY[name].build
    signals = {"dq": dq, "u": u}
    assert np.allclose(
        dry(cause, state(dq=dq, u=u), p),
        kernel.kernel(*(signals[key] for key in kernel.inputs), width=STEEP,
                      **{"exponent": 2.0, **p}))


STATIC = {"quadratic_drag", "spring", "torque_ripple", "periodic_disturbance",
          "encoder_eccentricity", "actuator_saturation", "dead_zone", "torque_gain_error"}


@given(signed, signed, signed, st.floats(0.0, 60.0), st.sampled_from(sorted(STATIC)), st.data())
def test_a_cause_without_memory_is_the_kernel_of_its_effect(q, dq, u, t, name, data):
    cause = next(one for one in CAUSES if one.name == name)
    p = {number.name: data.draw(positive) for number in cause.numbers}
    build = effects.LIBRARY[name].build
    signals = {"q": q, "dq": dq, "u": u, "t": t}
    rest = {"spring": {"rest": 0.0, "hardening": 0.0}, "dead_zone": {"jump": 0.0}}.get(name, {})
    expected = build.kernel(*(signals[key] for key in build.inputs), **rest, **p)
    value, _ = cause.pieces[0].act(state(q=q, dq=dq, u=u, t=t), [], p)
    assert np.array_equal(value, expected[0] if isinstance(expected, tuple) else expected)


@given(signed, signed, arrays(float, N, elements=st.floats(2e-4, 0.2)))
def test_a_lag_gives_the_mean_of_the_lagged_torque_over_a_period(u, z, time):
    h = 1e-3
    mean, (after,) = drive.ACTUATOR_LAG.pieces[0].act(state(u=u, h=h), [z], {"lag": time})
    assert np.allclose(after, lag.lag_step(z, u, time, h))
    instants = (np.arange(4000) + 0.5) / 4000 * h
    course = lag.lag_step(z, u, time, instants[:, None])
    assert np.allclose(mean, course.mean(axis=0), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("samples", [0, 1, 7, 3.25])
def test_a_delay_gives_the_mean_of_the_late_staircase(samples):
    rng = np.random.default_rng(3)
    h, commands = 1e-3, rng.standard_normal((80, N))
    memory = [np.zeros(N)] * dynamics.DELAY_TAPS
    given_out = []
    for u in commands:
        late, memory = drive.TIME_DELAY.pieces[0].act(
            state(u=u, h=h), memory, {"delay": np.full(N, samples * h)})
        given_out.append(late)
    staircase = np.vstack([np.zeros((dynamics.DELAY_TAPS, N)), commands])
    whole, part = divmod(samples, 1)
    at = np.arange(80) + dynamics.DELAY_TAPS - int(whole)
    expected = (1 - part) * staircase[at] + part * staircase[at - 1]
    assert np.allclose(given_out, expected)


def test_presliding_is_a_dahl_contact():
    reach, level, h = np.array([0.004, 0.01, 0.03]), np.array([0.2, 0.5, 1.0]), 1e-3
    speed = np.array([0.3, 0.1, 0.4])

    def velocity(t):
        return speed * np.cos(9.0 * t)

    bent = solve_ivp(lambda t, z: presliding.dahl_rate(z, velocity(t), reach, 1.0, 1e9),
                     (0.0, 1.0), np.zeros(N), max_step=2e-4, rtol=1e-9, atol=1e-12)
    numbers = {"reach": reach, "level": level, "bristle_damping": np.zeros(N)}
    z = [np.zeros(N)]
    for k in range(1000):
        now = dataclasses.replace(state(h=h), dq=velocity((k + 0.5) * h))
        _, z = friction.PRESLIDING.pieces[0].act(now, z, numbers)
    expected = presliding.dahl_torque(bent.y[:, -1], 1e-9, level, reach, 1e9)
    assert np.allclose(level / reach * z[0], expected, rtol=2e-3, atol=2e-3 * level.min())


def passed(cause, twist, rate, numbers, link, motor):
    """Torque that a gear without a memory passes on."""
    torque, _ = cause.pieces[0].act(twist, rate, [], 1e-3, numbers, link, motor)
    return torque


@given(signed, signed, positive, positive, positive)
def test_a_gear_that_stiffens(twist, rate, frequency, knee, stiffening):
    numbers = {"frequency": frequency, "damping_ratio": np.full(N, 0.1), "knee": knee,
               "stiffening": stiffening}
    omega = 2 * np.pi * frequency
    assert np.allclose(
        passed(transmission.STIFFENING_ELASTICITY, twist, rate, numbers, np.ones(N), np.ones(N)),
        stiffening_elasticity.stiffening_torque(twist, rate, 1 / omega**2, stiffening, knee,
                                                0.2 * omega))


def test_a_gear_that_slips_follows_the_rate_of_the_catalogue():
    reach, h, steps = np.array([2e-3, 1e-2, 5e-2]), 2e-4, 5000

    def rate(t):
        return np.array([0.2, 0.1, 0.4]) * np.cos(9.0 * t)

    slipped = solve_ivp(lambda t, z: torsional_hysteresis.slip_rate(z, rate(t), reach),
                        (0.0, steps * h), np.zeros(N), max_step=2e-4, rtol=1e-9, atol=1e-12)
    numbers = {"frequency": np.full(N, 5.0), "damping_ratio": np.zeros(N), "level": np.ones(N),
               "reach": reach}
    z = [np.zeros(N)]
    for k in range(steps):
        _, z = transmission.TORSIONAL_HYSTERESIS.pieces[0].act(
            np.zeros(N), rate((k + 0.5) * h), z, h, numbers, np.ones(N), np.ones(N))
    assert np.allclose(z[0], slipped.y[:, -1], atol=3e-3)


@given(signed, signed, positive, positive, positive)
def test_a_gear_that_gives_way(twist, rate, frequency, link, motor):
    numbers = {"frequency": frequency, "damping_ratio": np.full(N, 0.1)}
    omega = 2 * np.pi * frequency
    assert np.allclose(
        passed(transmission.JOINT_ELASTICITY, twist, rate, numbers, link, motor),
        joint_elasticity.elastic_torque(twist, rate, 1 / (link * omega**2), 0.2 * link * omega))


@given(signed, positive, positive, positive)
def test_a_pressed_flank_is_the_spring_of_the_catalogue(twist, half, link, motor):
    numbers = {"half_gap": half, "contact": np.full(N, 300.0)}
    both = 1.0 / (1.0 / link + 1.0 / motor)
    assert np.allclose(
        passed(transmission.BACKLASH, twist, np.zeros(N), numbers, link, motor),
        backlash.contact_torque(twist, np.zeros(N), half, both * 300.0**2, 0.0))


def test_a_flank_never_pulls():
    twist, numbers = np.array([0.011, -0.011, 0.0]), {
        "half_gap": np.full(N, 0.01), "contact": np.full(N, 300.0)}
    leaving = passed(transmission.BACKLASH, twist, -50.0 * np.sign(twist), numbers, np.ones(N),
                     np.ones(N))
    assert np.all(leaving * twist >= 0.0)


@pytest.mark.parametrize("travel", [(2.0, 2.0), (2.0, 0.3)])
def test_waves_over_the_travel_reach_where_the_spectrum_begins_at_every_joint(travel):
    """It finds no less than a wave over the travel of a joint, whatever the others travel."""
    orders = np.array(waves_over_travel(SimpleNamespace(travel=np.array(travel))))
    assert (orders.max(axis=0) > 2 * np.pi / np.array(travel)).all()
    assert orders.min() == pytest.approx(3.0) and orders.max() <= 48.0
