"""A law of the user's own: its linearisation, its state at the first sample, its commands."""

import dataclasses

import control as ct
import numpy as np
import pytest
from factories import make_law, make_log
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.problem.drive_signals import with_drive_rest
from clie_blocks.analysis.gap.problem.own_law import block_law, with_law_state
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.errors import ClieError
from clie_blocks.linear_filters import frequency_response
from clie_blocks.robot_loop.dynamics import formed_velocity
from clie_blocks.robot_loop.sampled_law import sampled_law

T = 0.01
FREE, EXACT = np.array([np.inf]), np.zeros(1)
FREQUENCIES = np.geomspace(0.02, 3.0, 30)


def pid(ki=3.0, n=1, limit=np.inf, weight=0.0):
    """PID with a difference, as a user would write it; its states are the sum and the last q."""
    gains = {"kp": np.full(n, 40.0), "ki": np.full(n, float(ki)), "kd": np.full(n, 8.0)}

    def update(t, x, u, params):
        return np.concatenate((x[:n] + T * (u[:n] - u[n:]), u[n:]))

    def output(t, x, u, params):
        q_d, q = u[:n], u[n:]
        return np.clip(params["kp"] * (q_d - q) + params["ki"] * x[:n]
                       - params["kd"] * (q - x[n:]) / T + weight * np.cos(q), -limit, limit)

    return ct.nlsys(update, output, name="pid", dt=T, states=2 * n, params=gains,
                    inputs=[f"{name}[{k}]" for name in ("q_d", "q") for k in range(n)],
                    outputs=[f"u[{k}]" for k in range(n)])


def on_velocity():
    """PID on the velocity of the drive, which carries some friction by its direction."""
    return ct.nlsys(
        lambda t, x, u, params: x + T * (u[:1] - u[1:2]),
        lambda t, x, u, params: (40.0 * (u[:1] - u[1:2]) + 3.0 * x - 8.0 * u[2:]
                                 + np.tanh(2.0 * u[2:])),
        name="own", dt=T, states=1, inputs=["q_d[0]", "q[0]", "dq[0]"], outputs=["u[0]"])


def law_of(block, n=1, pose=0.0):
    return block_law(sampled_law(block, T), np.full(n, pose), np.full(n, np.inf), np.zeros(n))


def log_of(q, u, q_d):
    log = make_log(q, u)
    return type(log)(log.name, q, u, q_d, 0.0 * q, q[0], True, 0.0 * q)


def motion(rows=600, seed=0):
    t = T * np.arange(rows)[:, None]
    q_d = 0.4 * np.sin(2.1 * t) + 0.1 * np.sin(9.0 * t + 1.0)
    return q_d - 0.02 * np.cos(6.0 * t) + 1e-4 * np.random.default_rng(seed).normal(size=(rows, 1)
                                                                                   ), q_d


def test_sensitivities_of_pd_as_a_block_are_those_of_the_stated_law():
    stated, own = make_law(period=T), law_of(pid(ki=0.0))
    for name in ("torque_sensitivity", "sensor_sensitivity"):
        one, other = (frequency_response(*getattr(law, name)(0, 0.5, 0.7), FREQUENCIES)
                      for law in (stated, own))
        np.testing.assert_allclose(other, one, rtol=1e-7)
    assert own.kp == pytest.approx([40.0], rel=0.03) and own.kd == pytest.approx([8.0], rel=0.01)


def test_feedback_of_pid_is_its_transfer_function():
    z = np.exp(1j * FREQUENCIES)
    wanted = 40.0 + 3.0 * T / (z - 1) + 8.0 * (1 - 1 / z) / T
    (feedback,) = law_of(pid()).feedback
    np.testing.assert_allclose(frequency_response(*feedback, FREQUENCIES), wanted, rtol=1e-7)


@given(st.integers(0, 10**6))
def test_feedback_of_any_linear_law_is_that_of_python_control(seed):
    rng = np.random.default_rng(seed)
    states = int(rng.integers(1, 5))
    a = rng.normal(size=(states, states))
    a *= rng.uniform(0.1, 0.95) / np.abs(np.linalg.eigvals(a)).max()
    system = ct.ss(a, rng.normal(size=(states, 2)), rng.normal(size=(1, states)),
                   [[2.0, -2.0]], T, inputs=["q_d[0]", "q[0]"], outputs=["u[0]"], name="law")
    (feedback,) = law_of(system).feedback
    wanted = -system(np.exp(1j * FREQUENCIES))[0, 1]
    np.testing.assert_allclose(frequency_response(*feedback, FREQUENCIES), wanted,
                               rtol=1e-5, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("corners", [None, (150.0, 1e5)], ids=["difference", "lag"])
def test_a_measured_velocity_is_linearised_as_models_form_it(corners):
    velocity = velocity_filter("backward" if corners else "difference", T, corners)
    law = block_law(sampled_law(on_velocity(), T), np.full(1, 0.3), FREE, EXACT, velocity=velocity)
    z, (b, a) = np.exp(1j * FREQUENCIES), velocity
    rate = (b[0] + b[1] / z + b[2] / z**2) / (a[0] + a[1] / z + a[2] / z**2)
    wanted = 40.0 + 3.0 * T / (z - 1) + (8.0 - 2.0) * rate  # it carries 2 N m per rad/s at rest
    (feedback,) = law.feedback
    np.testing.assert_allclose(frequency_response(*feedback, FREQUENCIES), wanted, rtol=1e-6)
    other = law.with_parameters(law.parameters).feedback[0]
    np.testing.assert_array_equal(np.concatenate(other), np.concatenate(feedback))


def test_a_loop_around_the_torque_is_linearised_with_the_drive_of_a_model():
    g, scale = 0.3, 2.5  # N m per unit of command, in which the torque is logged, too
    block = ct.nlsys(
        lambda t, x, u, params: x + g * (40.0 * (u[:1] - u[1:2]) - u[2:]),
        lambda t, x, u, params: 40.0 * (u[:1] - u[1:2]) + x, name="around", dt=T, states=1,
        inputs=["q_d[0]", "q[0]", "tau[0]"], outputs=["u[0]"])
    law = block_law(sampled_law(block, T, [scale]), np.zeros(1), FREE, EXACT)
    z = np.exp(1j * FREQUENCIES)
    wanted = scale * 40.0 * (1 + g / (z - 1)) / (1 + g / (z * (z - 1)))
    np.testing.assert_allclose(frequency_response(*law.feedback[0], FREQUENCIES), wanted,
                               rtol=1e-6)


def test_commands_on_a_measured_velocity_are_those_by_hand():
    law, (q, q_d) = law_of(on_velocity()), motion()
    dq = np.random.default_rng(1).normal(size=q.shape)  # of a drive, whatever q does
    log = dataclasses.replace(log_of(q, q, q_d), of_drive={"dq": dq})
    first, by_hand = 0.2, []
    total = first
    for position, reference, speed in zip(q[:, 0], q_d[:, 0], dq[:, 0]):
        by_hand.append(40.0 * (reference - position) + 3.0 * total - 8.0 * speed
                       + np.tanh(2.0 * speed))
        total += T * (reference - position)
    log = with_law_state(dataclasses.replace(log, u=np.array(by_hand)[:, None]), law)
    assert log.law_state == pytest.approx([first], rel=1e-8)
    np.testing.assert_allclose(law.commands(log)[:, 0], by_hand, rtol=1e-10, atol=1e-10)


def test_a_model_that_moves_as_the_robot_did_reads_the_velocity_that_was_logged():
    velocity = velocity_filter("backward", T, (150.0, 1e5))
    law = block_law(sampled_law(on_velocity(), T), np.zeros(1), FREE, EXACT, velocity=velocity)
    q, q_d = motion()
    dq = np.gradient(q, T, axis=0) + 0.01 * np.random.default_rng(2).normal(size=q.shape)
    log = with_drive_rest(dataclasses.replace(log_of(q, q, q_d), of_drive={"dq": dq}), law)
    memory, read = [np.zeros(1)] * 2, []
    for k in range(len(q)):
        rate, memory = formed_velocity(q[k] - q[0], memory, law.numerator, law.denominator)
        read.append(rate + log.drive_rest[k] + log.drive_dither[k])
    np.testing.assert_allclose(read, dq, atol=1e-10)
    assert np.std(log.drive_dither) == pytest.approx(0.01, rel=0.2)  # the noise of the drive


def test_states_of_other_joints_take_no_part_in_a_feedback():
    law = law_of(pid(n=3), n=3)
    assert [len(a) for _, a in law.feedback] == [3, 3, 3]


def test_a_weight_is_linearised_at_the_pose():
    (level,), (upright,) = (law_of(pid(weight=6.0), pose=pose).feedback
                            for pose in (0.0, np.pi / 2))
    b, a = (np.polyval(side, 1.0 - 1e-4) for side in level)
    d, c = (np.polyval(side, 1.0 - 1e-4) for side in upright)
    assert d / c - b / a == pytest.approx(6.0, rel=1e-3)  # -du/dq of weight cos(q)


def test_commands_follow_from_the_signals_and_the_first_state():
    law, (q, q_d) = law_of(pid(ki=25.0)), motion()
    first = np.array([0.3, -0.05])
    u = law.run(law.inputs(q, q_d), [first])[0]
    x, by_hand = first, []
    for row, reference in zip(q[:, 0], q_d[:, 0]):
        by_hand.append(40.0 * (reference - row) + 25.0 * x[0] - 8.0 * (row - x[1]) / T)
        x = np.array([x[0] + T * (reference - row), row])
    np.testing.assert_allclose(u[:, 0], by_hand, rtol=1e-10, atol=1e-10)
    log = with_law_state(log_of(q, u, q_d), law)
    np.testing.assert_allclose(log.law_state, first, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(law.commands(log), u, rtol=1e-9, atol=1e-9)


def test_what_the_commands_do_not_show_of_a_state_stays_at_rest():
    law, (q, q_d) = law_of(pid(ki=0.0)), motion()
    log = with_law_state(log_of(q, law.run(law.inputs(q, q_d), [[0.0, q[0, 0]]])[0], q_d), law)
    assert abs(log.law_state[0]) < 1e-3 and log.law_state[1] == pytest.approx(q[0, 0])


def test_a_controller_faster_than_the_log_begins_at_rest():
    law, (q, q_d) = law_of(pid()), motion()
    log = log_of(q, q, q_d)
    object.__setattr__(log, "stride", 4)
    assert with_law_state(log, law) is log


def test_samples_at_the_limit_say_nothing_of_the_state():
    block = sampled_law(pid(ki=25.0), T)
    law = block_law(block, np.zeros(1), np.array([2.0]), np.zeros(1))
    q, q_d = motion()
    u = np.clip(law.run(law.inputs(q, q_d), [[0.02, q[0, 0]]])[0], -2.0, 2.0)
    assert 0.1 < np.mean(np.abs(u) == 2.0) < 0.9
    log = with_law_state(log_of(q, u, q_d), law)
    np.testing.assert_allclose(law.commands(log), u, atol=1e-8)


def test_a_law_that_meets_its_own_limit_at_the_first_sample_is_followed():
    law, (q, q_d) = law_of(pid(ki=25.0, limit=2.0)), motion()
    u = law.run(law.inputs(q, q_d), [[0.02, q[0, 0]]])[0]
    assert np.abs(law.replay(q, q_d, 0.0)[0]) == 2.0  # from rest elsewhere it would
    log = with_law_state(log_of(q, u, q_d), law)
    np.testing.assert_allclose(law.commands(log), u, atol=1e-6)


def test_sums_do_not_keep_a_law_from_settling():
    assert law_of(pid()).settling < 10


def test_a_law_without_feedback_is_refused():
    constant = ct.ss([], [], [], [[1.0, 0.0]], T, inputs=["q_d[0]", "q[0]"], outputs=["u[0]"])
    with pytest.raises(ClieError, match="no position changes.*unknown"):
        law_of(constant)


def test_a_law_that_gives_no_numbers_is_refused():
    root = ct.nlsys(None, lambda t, x, u, params: u[:1] - u[1:] + 0 * np.log(u[1:]), name="root",
                    inputs=["q_d[0]", "q[0]"], outputs=["u[0]"], dt=T)
    with pytest.raises(ClieError, match="root: the law gives NaN or infinity.*divisions"):
        law_of(root, pose=-1.0)


def test_in_pd_form_it_is_a_stated_law_of_its_gains():
    own = law_of(pid(ki=0.0))
    nearest = own.pd
    assert type(nearest) is type(make_law()) and nearest.pd is nearest
    assert nearest.kp == pytest.approx(own.kp) and nearest.kd == pytest.approx(own.kd)
