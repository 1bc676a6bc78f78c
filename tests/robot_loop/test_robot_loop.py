"""The sampled robot against its continuous diagram, closed forms, and another engine."""

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import decoupled_joints
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop import robot_loop

A, B, KP, KD = 2.0, 0.5, 10.0, 5.0  # of the joint, 1/s and 1/(kg m^2), and of the law


def set_point(t):
    return 0.6 * np.sin(1.3 * t)


def sampled_run(period, duration, effects=(), **law):
    """Position at each sample under a moving set-point."""
    law = {"kp": KP, "kd": KD, **law}
    block = robot_loop([1.0 / B], [A / B], period=period, effects=effects, **law)
    steps = round(duration / period)
    t = period * np.arange(steps)
    rows = np.column_stack([set_point(t), np.zeros(steps), np.zeros(steps)])
    run = compile_diagram(block).run(duration, inputs=rows, log=["q[0]"])
    return t, np.asarray(run.outputs).ravel()[:steps]


def continuous_run(duration, effects=()):
    """The same joint under the continuous law, integrated finely."""
    plant = with_effects(decoupled_joints([A], [B], [0.0], name="plant"), effects)
    loop = joint_loop(plant, [KP], [KD])
    run = compile_diagram(loop).run(duration, 2.5e-4, "ode4", log=["q[0]"], inputs={
        "q_d": lambda t: np.array([set_point(t)]), "pe": [0.0]})
    return np.asarray(run.time), np.asarray(run.outputs).ravel()


TWO_BODIES = {"damping": 0.6, "motor_inertia": 1.1, "motor_damping": 2.0}
SMOOTH = {"none": [], "spring": [LIBRARY["spring"](stiffness=3.0, hardening=0.5)],
          "drag": [LIBRARY["quadratic_drag"](drag=0.8)],
          "gain": [LIBRARY["torque_gain_error"](error=-0.2)],
          "lag": [LIBRARY["actuator_lag"](lag=0.05)],
          "eccentricity": [LIBRARY["encoder_eccentricity"](sine=0.02, cosine=0.01, order=3.0)],
          "ripple": [LIBRARY["torque_ripple"](sine=0.4, order=5.0)],
          "elastic": [LIBRARY["joint_elasticity"](compliance=0.02, **TWO_BODIES)],
          "stiffening": [LIBRARY["stiffening_elasticity"](
              compliance=0.02, stiffening=3.0, knee=0.5, **TWO_BODIES)],
          "hysteretic": [LIBRARY["torsional_hysteresis"](
              stiffness=50.0, level=0.4, reach=0.03, **TWO_BODIES)]}


@pytest.mark.parametrize("name", SMOOTH)
def test_it_converges_to_the_continuous_diagram_with_the_first_order(name):
    """The law is held for a period and differentiates two samples: one period behind, in all."""
    duration, errors = 4.0, []
    fine_t, fine_q = continuous_run(duration, SMOOTH[name])
    for period in (8e-3, 4e-3, 2e-3):
        t, q = sampled_run(period, duration, SMOOTH[name])
        errors.append(np.abs(q - np.interp(t, fine_t, fine_q)).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(orders - 1.0) < 0.15), (errors, orders)


@pytest.mark.parametrize("period", [1e-3, 5e-4, 2e-4])
def test_a_delay_of_many_samples_is_that_of_few(period):
    delayed = [LIBRARY["time_delay"](delay=0.045)]
    coarse_t, coarse_q = sampled_run(2e-3, 2.0, delayed)
    t, q = sampled_run(period, 2.0, delayed)
    assert np.interp(coarse_t, t, q) == pytest.approx(coarse_q, abs=5e-4)
    assert np.ptp(q) > 0.4


HOLD = 2e-2  # s, of the driving torque
TORQUE = np.sin(2.0 * HOLD * np.arange(150))


def driven(t, x):
    """Rate of a joint on a stiffening spring, driven by a torque that is held."""
    torque = TORQUE[min(int(t / HOLD + 1e-9), len(TORQUE) - 1)]
    return x[1], torque - 0.3 * x[1] - 4.0 * x[0] * (1 + x[0] ** 2)


def test_a_driven_joint_without_a_law_converges_with_the_second_order():
    duration, errors = HOLD * len(TORQUE), []
    for period in (2e-2, 1e-2, 5e-3):
        block = robot_loop([1.0], [0.3], kp=[0.0], kd=[0.0], period=period,
                           effects=[LIBRARY["spring"](stiffness=4.0, hardening=1.0)])
        held = np.repeat(TORQUE, round(HOLD / period))  # one input for all periods
        rows = np.column_stack([0 * held, held, 0 * held])
        q = np.asarray(compile_diagram(block).run(duration, inputs=rows, log=["q[0]"]).outputs)
        exact = solve_ivp(driven, (0, duration - period), (0.0, 0.0), max_step=2e-3, rtol=1e-9,
                          atol=1e-12).y[0, -1]
        errors.append(abs(q.ravel()[held.size - 1] - exact))
    assert errors[0] / errors[2] > 10.0, errors


def test_dry_friction_holds_a_joint_for_good_and_lets_it_go_above():
    friction = [LIBRARY["coulomb"](level=0.4)]
    for torque, moves in ((0.39, False), (0.41, True)):
        block = robot_loop([1.0 / B], [A / B], kp=[0.0], kd=[0.0], period=1e-3,
                           effects=friction)
        rows = np.column_stack([np.zeros(5000), np.full(5000, torque), np.zeros(5000)])
        q = np.asarray(compile_diagram(block).run(5.0, inputs=rows, log=["q[0]"]).outputs).ravel()
        assert (q[-1] > 1e-3) == moves
        assert moves or not np.any(q)  # stuck, not creeping


def test_every_parameter_can_be_set_in_a_run():
    block = robot_loop([1.0, 2.0], [0.1, 0.2], [5.0, 6.0], [1.0, 1.0], 1e-3,
                       effects=[LIBRARY["coulomb"](level=0.1, joints=1)])
    assert {"inertia", "kp", "coulomb.level"} <= set(block.params)
    np.testing.assert_array_equal(block.params["coulomb.level"], [0.0, 0.1])
    assert block.input_labels[:2] == ["q_d[0]", "q_d[1]"] and block.dt == 1e-3


@pytest.mark.parametrize("limit", [1e9, 2.0])
def test_a_supply_at_four_fifths_gives_four_fifths_of_every_torque(limit):
    """Of the limit, too: the same joint with gains, and a limit, that are so much smaller."""
    t = 2e-3 * np.arange(2000)
    zero = np.zeros(t.size)
    rows = np.column_stack([set_point(t), zero, zero, 0.8 + zero])
    robot = [1.0 / B], [A / B]
    low = robot_loop(*robot, [KP], [KD], 2e-3, saturation=limit, supplied=True)
    weak = robot_loop(*robot, [0.8 * KP], [0.8 * KD], 2e-3, saturation=0.8 * limit)
    assert low.input_labels[-1] == "supply[0]"
    of_low, of_weak = (np.asarray(compile_diagram(block).run(4.0, inputs=inputs).outputs)
                       for block, inputs in ((low, rows), (weak, rows[:, :3])))
    np.testing.assert_allclose(of_low[0], of_weak[0], atol=1e-12)
    np.testing.assert_allclose(0.8 * of_low[1], of_weak[1], atol=1e-10)
    assert limit > 1e3 or np.mean(np.abs(of_low[1]) == limit) > 0.1


def test_wrong_numbers_and_effects_without_a_form_are_refused():
    with pytest.raises(DiagramError, match="period must be positive"):
        robot_loop([1.0], [0.1], [5.0], [1.0], 0.0)
    with pytest.raises(DiagramError, match="two effects are called 'coulomb'"):
        robot_loop([1.0], [0.1], [5.0], [1.0], 1e-3, effects=[LIBRARY["coulomb"](level=1)] * 2)
    with pytest.raises(DiagramError, match="hidden_integral: it enters at the controller"):
        robot_loop([1.0], [0.1], [5.0], [1.0], 1e-3,
                   effects=[LIBRARY["hidden_integral"](ki=1.0)])


def test_it_is_linearised_like_any_block():
    spring = LIBRARY["spring"](stiffness=1.5, hardening=0.0)
    block = robot_loop([2.0], [0.3], [40.0], [8.0], 1e-2, effects=[spring])
    linear = ct.linearize(block, np.zeros(block.nstates), np.zeros(block.ninputs))
    t = 1e-2 * np.arange(300)
    u = np.stack([np.sin(3.0 * t), np.full(t.size, 0.5), np.zeros(t.size)])
    whole, small = (ct.input_output_response(one, t, u).outputs for one in (block, linear))
    size = np.max(np.abs(whole), axis=1, keepdims=True)
    np.testing.assert_allclose(small / size, whole / size, atol=1e-6)
    assert np.all(size > 0.5)


LINK, MOTOR, STIFFNESS = 0.8, 1.2, 320.0  # kg m^2, N m/rad of the motor


@pytest.mark.parametrize("on_motor", [False, True])
def test_an_encoder_on_the_motor_sees_the_antiresonance_of_the_link(on_motor):
    """Closed form: held by its encoder, the motor stands still at the rate of the clamped link."""
    period = 1e-3
    soft = LIBRARY["joint_elasticity"](compliance=1 / STIFFNESS, damping=0.0,
                                       motor_inertia=MOTOR, motor_damping=0.0)
    block = robot_loop([LINK + MOTOR], [0.0], [40.0], [0.0], period, effects=[soft],
                       encoder_on_motor=on_motor)
    linear = ct.linearize(block, np.zeros(block.nstates), np.zeros(block.ninputs))
    zeros = ct.zeros(ct.ss(linear.A, linear.B[:, [1]], linear.C[[0]], linear.D[[0], [1]], period))
    rates = np.abs(np.angle(zeros)) / period
    clamped = np.sqrt(STIFFNESS / LINK)
    is_seen = bool(np.any(np.abs(rates / clamped - 1) < 1e-2))
    assert is_seen == on_motor
