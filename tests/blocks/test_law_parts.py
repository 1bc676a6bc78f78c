"""Parts of sampled laws: feedforward, models, filters, dead band, limits, by plain sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from clie_blocks.controllers import (
    laws_side_by_side,
    sampled_cascade,
    sampled_pid,
    with_dead_band,
    with_feedforward,
    with_filter,
    with_inverse_dynamics,
    with_rate_limit,
    with_torque_speed,
)
from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body import dynamics
from clie_blocks.robot_loop.links import planar_links

T = 0.002
TIME = T * np.arange(80)
Q_D = 0.4 * np.sin(5.0 * TIME)
Q = Q_D - 0.02 * np.cos(9.0 * TIME)
gains = st.floats(-2.0, 2.0)


def pd(kp=3.0, kd=0.1):
    return sampled_pid([kp], [0.0], [kd], T)


def run(law, q_d=Q_D, q=Q, pe=0.0):
    """Commands (N, n) of a law from zero states."""
    q_d, q = (np.reshape(x, (len(x), -1)) for x in (q_d, q))
    x, commands = np.zeros(law.nstates), []
    for reference, position in zip(q_d, q):
        u = np.concatenate([reference, position, pe + 0.0 * position])
        commands.append(law.output(0.0, x, u))
        x = law.dynamics(0.0, x, u) if law.nstates else x
    return np.squeeze(commands)


@settings(max_examples=10, deadline=None)
@given(gains, gains, gains)
def test_feedforward_is_what_the_derivatives_of_the_reference_give(kv, ka, c):
    added = run(with_feedforward(pd(), velocity=kv, acceleration=ka, coulomb=c, width=0.1,
                                 rate="trajectory")) - run(pd())
    rate, turn = 2.0 * np.cos(5.0 * TIME), -10.0 * np.sin(5.0 * TIME)
    wanted = kv * rate + ka * turn + c * np.tanh(rate / 0.1)
    np.testing.assert_allclose(added[5:], wanted[5:], atol=1e-4)


def test_feedforward_of_differences_is_late_by_half_a_sample():
    added = run(with_feedforward(pd(), velocity=1.0)) - run(pd())
    np.testing.assert_allclose(added[2:], 2.0 * np.cos(5.0 * (TIME[2:] - T / 2)), atol=1e-4)


def test_a_feedforward_of_kd_through_the_same_filter_is_the_velocity_of_the_error():
    law = with_feedforward(pd(), velocity=0.1, rate="filtered")
    of_error = sampled_pid([3.0], [0.0], [0.1], T, velocity_of_error=True)
    np.testing.assert_allclose(run(law), run(of_error), atol=1e-12)


def test_filters_are_those_of_the_textbook():
    plain = run(pd())
    share = 1.0 - np.exp(-50.0 * T)
    np.testing.assert_allclose(run(with_filter(pd(), "command", lowpass=50.0)),
                               lfilter([share], [1.0, share - 1.0], plain), atol=1e-12)
    w, z = 300.0, 0.4
    warped = 2.0 / T * np.tan(w * T / 2.0)
    b, a, _ = cont2discrete(([1.0, 0.0, warped**2], [1.0, 2.0 * z * warped, warped**2]), T,
                            "bilinear")
    np.testing.assert_allclose(run(with_filter(pd(), "command", notch=w, notch_width=z)),
                               lfilter(b[0], a, plain), atol=1e-10)


def test_a_filter_of_the_error_leaves_the_velocity_alone():
    share = 1.0 - np.exp(-50.0 * T)
    error = lfilter([share], [1.0, share - 1.0], Q_D - Q)
    wanted = 3.0 * error - 0.1 * np.diff(Q, prepend=0.0) / T
    np.testing.assert_allclose(run(with_filter(pd(), "error", lowpass=50.0)), wanted, atol=1e-10)


def test_a_dead_band_is_silent_within_and_punches_beyond():
    u, error = run(with_dead_band(pd(kd=0.0), 0.01, 0.3)), Q_D - Q
    assert not u[np.abs(error) < 0.01].any()
    beyond = np.abs(error) > 0.01
    np.testing.assert_allclose(np.abs(u[beyond]), 3.0 * (np.abs(error[beyond]) - 0.01) + 0.3)


def test_a_limit_of_the_rate_is_kept_and_reached():
    u = run(with_rate_limit(pd(), 1.0))
    change = np.abs(np.diff(u))
    assert change.max() == pytest.approx(T) and np.all(change < T * (1 + 1e-9))


def test_torque_over_speed_falls_only_where_the_motor_drives():
    q = 2.0 * TIME  # 2 rad/s
    fast = run(with_torque_speed(pd(100.0, 0.0), 1.0, 4.0), q + 1.0, q)
    np.testing.assert_allclose(fast[3:], 0.5)
    braking = run(with_torque_speed(pd(100.0, 0.0), 1.0, 4.0), q - 1.0, q)
    np.testing.assert_allclose(braking[3:], -1.0)


def test_a_slower_position_loop_holds_its_output():
    q = np.zeros(20)
    q_d = np.arange(20.0)
    u = run(sampled_cascade([1.0], [1.0], [0.0], T, every=4), q_d, q)
    np.testing.assert_allclose(u, np.repeat(np.arange(0.0, 20.0, 4.0), 4))


LINKS = planar_links([0.4, 0.3], [1.0, 0.5], [0.2, 0.15], [0.02, 0.004], has_gravity=True,
                     has_coupling=True)


def model(q, dq, ddq, params):
    return params["mass"] * dynamics.inverse_dynamics(LINKS.tree, q, dq, ddq) + 0.3 * dq


def with_model(form):
    law = sampled_pid([20.0, 10.0], [0.0, 0.0], [2.0, 1.0], T)
    return law, with_inverse_dynamics(law, model, {"mass": np.ones(2)}, form)


@pytest.mark.parametrize("form", ["inverse_dynamics", "pd_plus"])
def test_on_its_path_a_law_with_a_model_gives_the_torque_of_the_path(form):
    law, with_it = with_model(form)
    w = np.array([3.0, 4.0])
    q = 0.5 * np.sin(np.outer(TIME, w))
    dq, ddq = 0.5 * w * np.cos(np.outer(TIME, w)), -0.5 * w**2 * np.sin(np.outer(TIME, w))
    added = run(with_it, q, q) - run(law, q, q)
    wanted = [model(*row, {"mass": np.ones(2)}) for row in zip(q, dq, ddq)]
    np.testing.assert_allclose(added[6:], wanted[6:], atol=0.02)


def test_computed_torque_of_the_right_model_decouples_the_joints():
    _, law = with_model("computed_torque")
    mass = np.stack([dynamics.inverse_dynamics(
        LINKS.tree.with_gravity((0.0, 0.0, 0.0)), np.array([0.3, 0.8]), np.zeros(2), unit)
        for unit in np.eye(2)], axis=1)
    q, q_d = np.array([0.3, 0.8]), np.array([0.4, 0.6])
    rest = np.zeros(law.nstates)
    labels = law.state_labels
    for k in range(2):
        for name in ("reference_1", "reference_2", "reference_3", "reference_4"):
            rest[labels.index(f"{name}[{k}]")] = q_d[k]
        for name in ("rate_1", "velocity_1"):  # difference of samples, at rest at q
            rest[labels.index(f"{name}[{k}]")] = -q[k] / T
    u = law.output(0.0, rest, np.concatenate([q_d, q, np.zeros(2)]))
    weight = model(q, np.zeros(2), np.zeros(2), {"mass": np.ones(2)})
    np.testing.assert_allclose(np.linalg.solve(mass, u - weight), [20.0 * 0.1, -10.0 * 0.2],
                               rtol=1e-9)


def test_each_joint_runs_under_its_own_law():
    one = sampled_pid([1.0, 1.0], [0.0, 0.0], [0.0, 0.0], T)
    other = with_feedforward(sampled_pid([5.0, 5.0], [0.0, 0.0], [0.0, 0.0], T), velocity=2.0)
    joined = laws_side_by_side([one, other], [0, 1])
    assert joined.params["kp"].tolist() == [1.0, 5.0]
    q_d, q = (np.outer(x, [1.0, 1.0]) for x in (Q_D, Q))
    np.testing.assert_allclose(run(joined, q_d, q),
                               np.stack([run(one, q_d, q)[:, 0], run(other, q_d, q)[:, 1]], 1))


@pytest.mark.parametrize(("build", "said"), [
    (lambda: with_feedforward(pd(), rate="trajectry"), "trajectory"),
    (lambda: with_filter(pd(), "comand", lowpass=1.0), "command"),
    (lambda: with_filter(pd(), "command", lowpass=-1.0), "command_lowpass"),
    (lambda: with_dead_band(pd(), -0.1), "dead_band"),
    (lambda: with_inverse_dynamics(pd(), model, {}, "pd_minus"), "pd_plus"),
    (lambda: sampled_cascade([1.0], [1.0], [0.0], T, every=0), "whole number")])
def test_a_wrong_number_or_name_is_refused_with_the_right_one(build, said):
    with pytest.raises(DiagramError, match=said):
        build()
