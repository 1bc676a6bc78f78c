"""PID and cascade in samples: by hand, in closed form, and held at their limits."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.controllers import VelocityFilter, sampled_cascade, sampled_pid
from clie_blocks.labels import DiagramError

T = 0.01
gains = st.floats(0.1, 50.0)


def run(law, q_d, q, pe=0.0):
    """Commands of a law of one joint on signals, from zero states."""
    x, commands = np.zeros(law.nstates), []
    for reference, position in zip(q_d, q):
        u = np.array([reference, position, pe])
        commands.append(law.output(0.0, x, u)[0])
        x = law.dynamics(0.0, x, u)
    return np.array(commands)


def signals(rows=60, seed=0):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(size=(2, rows)), axis=1) * 0.1


@given(gains, gains, gains, st.booleans())
def test_pid_is_its_sums_and_differences(kp, ki, kd, of_error):
    q_d, q = signals()
    law = sampled_pid([kp], [ki], [kd], T, velocity_of_error=of_error)
    seen = q - q_d if of_error else q
    wanted = (kp * (q_d - q) + ki * T * np.cumsum(q_d - q)
              - kd * np.diff(seen, prepend=0.0) / T + 0.3)
    np.testing.assert_allclose(run(law, q_d, q, 0.3), wanted, rtol=1e-9, atol=1e-9)


@given(gains, gains, gains)
def test_the_cascade_is_p_around_pi(kp, kv, ki):
    q_d, q = signals(seed=1)
    error = kp * (q_d - q) - np.diff(q, prepend=0.0) / T
    np.testing.assert_allclose(run(sampled_cascade([kp], [kv], [ki], T), q_d, q),
                               kv * error + ki * T * np.cumsum(error), rtol=1e-9, atol=1e-9)


def test_a_cascade_without_integral_is_pd_of_its_products():
    q_d, q = signals(seed=2)
    np.testing.assert_allclose(run(sampled_cascade([8.0], [0.5], [0.0], T), q_d, q),
                               run(sampled_pid([4.0], [0.0], [0.5], T), q_d, q), atol=1e-12)


def test_pid_has_the_transfer_function_of_the_textbook():
    b, a = [100.0, -100.0], [1.0, -0.6]  # a filtered difference
    rate = VelocityFilter(T, (b, a))
    law = ct.linearize(sampled_pid([4.0], [3.0], [0.5], T, velocity_filter=rate), np.zeros(3),
                       np.zeros(3))
    z = np.exp(1j * np.geomspace(0.01, 3.0, 20))
    wanted = -(4.0 + 3.0 * T / (1 - 1 / z) + 0.5 * (b[0] + b[1] / z) / (a[0] + a[1] / z))
    # A linear system of python-control has samples one per unit of time where dt is not given.
    states = ct.ss(law.A, law.B[:, 1:2], law.C, law.D[:, 1:2], T)
    np.testing.assert_allclose(states(z)[()], wanted, rtol=1e-6)


@pytest.mark.parametrize(("hold", "after"), [("conditional", 0.0), ("back_calculation", 0.0),
                                             ("none", 5.0)])
def test_what_an_integral_holds_behind_a_long_limit(hold, after):
    """Ten seconds of an error that the limit does not let it remove, then none."""
    law = sampled_pid([10.0], [1.0], [0.0], T, limit=[2.0], anti_windup=hold,
                      tracking_time=[0.05])
    steps, x = 1000, np.zeros(law.nstates)
    for _ in range(steps):
        u = np.array([0.5, 0.0, 0.0])
        assert law.output(0.0, x, u) == pytest.approx([2.0])
        x = law.dynamics(0.0, x, u)
    free = x[0]
    if hold == "back_calculation":  # in equilibrium what flows in flows back
        assert free == pytest.approx(2.0 - 5.0 + 0.05 * 0.5 - T * 0.5, abs=1e-6)
    else:
        assert free == pytest.approx(after, abs=1e-9)


def test_an_integral_leaves_a_limit_at_once_where_the_error_turns():
    law = sampled_pid([0.0], [10.0], [0.0], T, limit=[1.0])
    q_d = np.concatenate((np.ones(200), -np.ones(20)))
    u = run(law, q_d, np.zeros(220))
    assert u[199] == pytest.approx(1.0, abs=0.1) and u[-1] < -0.9


@pytest.mark.parametrize(("make", "message"), [
    (lambda: sampled_pid([1.0, 2.0], [1.0] * 3, [0.1, 0.1], T), "ki"),
    (lambda: sampled_pid([-1.0], [1.0], [0.1], T), "kp"),
    (lambda: sampled_pid([1.0], [1.0], [0.1], 0.0), "period must be positive"),
    (lambda: sampled_pid([1.0], [1.0], [0.1], T, anti_windup="clamp"), "'clamp' is not known"),
    (lambda: sampled_pid([1.0], [1.0], [0.1], T, tracking_time=0.0), "tracking_time"),
    (lambda: sampled_cascade([1.0], [1.0], [-0.1], T), "ki")])
def test_numbers_out_of_range_are_refused(make, message):
    with pytest.raises(DiagramError, match=message):
        make()


def test_corners_of_a_velocity_filter_are_parameters_of_its_law():
    rate = VelocityFilter(T, kind="tustin", corners=(20.0, 30.0))
    law = sampled_pid([4.0, 4.0], [0.0, 0.0], [1.0, 1.0], T, velocity_filter=rate)
    assert law.params["highpass"].tolist() == [20.0, 20.0]
    q = np.array([0.0, 0.0, 0.1, 0.1, 0.0, 0.0])
    slower = {**law.params, "lowpass": np.array([30.0, 5.0])}
    one, other = law.output(0.0, np.zeros(6), q, slower)
    assert abs(other) < abs(one)


def test_a_discretisation_that_is_not_known_gets_the_nearest():
    with pytest.raises(DiagramError, match="'tusten'.*tustin"):
        sampled_pid([1.0], [0.0], [1.0], T, velocity_filter=VelocityFilter(
            T, kind="tusten", corners=(20.0, 30.0)))
