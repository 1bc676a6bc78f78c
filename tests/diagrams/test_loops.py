"""The diagrams against block algebra, hand-written matrices, and the theory of the paper."""

import control as ct
import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.compiled import compile_diagram
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.diagrams.recorded_composite import recorded_composite
from clie_blocks.diagrams.recorded_loop import recorded_loop
from clie_blocks.diagrams.twin_loop import READINGS
from clie_blocks.excitation import paper_excitation
from clie_blocks.filters import difference_filter
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import DiagramError, signal

A, B, D = paper.THETA.reshape(3, 2)
OMEGA = np.logspace(-2, 3, 40)


def matched(**options):
    """Loop whose plant has exactly the structure of the model."""
    return clie_loop(decoupled_joints(A, B, D), paper.KP, paper.KD, paper.GAMMA, **options)


@pytest.fixture(scope="module")
def matched_run():
    """60 s of the matched, noise-free loop at Gamma = 80, where the estimates converge fast."""
    loop = clie_loop(decoupled_joints(A, B, D), paper.KP, paper.KD, 80.0)
    return compile_diagram(loop).run(
        150.0, step=1e-3, inputs={"q_d": paper.SET_POINT, "pe": paper_excitation}, every=10)


def test_linearised_joint_loop_is_the_matrix_by_hand():
    system = ct.linearize(joint_loop(decoupled_joints(A, B, D), paper.KP, paper.KD), 0, 0)
    zero, eye = np.zeros((2, 2)), np.eye(2)
    a = np.block([[zero, eye], [-np.diag(B * paper.KP), -np.diag(A + B * paper.KD)]])
    b = np.block([[zero, zero], [np.diag(B * paper.KP), np.diag(B)]])
    np.testing.assert_allclose(system.A, a, atol=1e-6)
    np.testing.assert_allclose(system.B, b, atol=1e-6)


def test_joint_loop_equals_block_algebra():
    """Second route: feedback() of transfer functions of one joint, without our wiring."""
    system = ct.linearize(joint_loop(decoupled_joints(A[:1], B[:1], D[:1]), 10.0, 5.0), 0, 0)
    s = ct.tf("s")
    plant = B[0] / (s * (s + A[0]))
    closed = ct.feedback(plant, ct.tf([5.0, 10.0], [1])) * 10.0
    np.testing.assert_allclose(system[0, 0](1j * OMEGA), closed(1j * OMEGA), rtol=1e-5)


def test_joint_loop_settles_where_statics_says():
    loop = joint_loop(decoupled_joints(A, B, D), paper.KP, paper.KD)
    run = compile_diagram(loop).run(30.0, step=1e-3, inputs={"q_d": [1.0, 0.5], "pe": 0.2},
                                    every=100)
    expected = np.array([1.0, 0.5]) + (0.2 - D / B) / paper.KP
    np.testing.assert_allclose(signal(run, "q")[:, -1], expected, rtol=1e-9)


@pytest.mark.parametrize("velocity", READINGS)
@pytest.mark.parametrize("composite", [False, True])
def test_compiled_equals_python_control_at_random_states(velocity, composite):
    build = clie_composite if composite else clie_loop
    gains = (paper.GAMMA, 1e-3) if composite else (paper.GAMMA,)
    loop = build(paper.paper_arm(), paper.KP, paper.KD, *gains, velocity=velocity)
    program, rng = compile_diagram(loop), np.random.default_rng(0)
    for _ in range(5):
        t, x, u = rng.uniform(0, 5), rng.normal(size=loop.nstates), rng.normal(size=loop.ninputs)
        np.testing.assert_allclose(program.dynamics(t, x, u), loop.dynamics(t, x, u), rtol=1e-11,
                                   atol=1e-11)
        np.testing.assert_allclose(program.output(t, x, u), loop.output(t, x, u), rtol=1e-11,
                                   atol=1e-11)


def test_compiled_run_equals_python_controls_own():
    loop = matched()
    time = np.linspace(0, 1, 101)
    u = np.vstack([np.tile(paper.SET_POINT[:, None], len(time)),
                   np.zeros((2, len(time)))])
    theirs = ct.input_output_response(loop, time, u, solve_ivp_kwargs={"rtol": 1e-9,
                                                                       "atol": 1e-11})
    ours = compile_diagram(loop).run(1.0, step=1e-3, every=10,
                                     inputs={"q_d": paper.SET_POINT, "pe": 0.0})
    np.testing.assert_allclose(ours.outputs, theirs.outputs, atol=1e-7)


@pytest.mark.parametrize("velocity", ["exact", "filtered-both"])
def test_exact_estimates_stay_exact(velocity):
    """With the true parameters and equal feedback, robot and model move as one."""
    run = compile_diagram(matched(velocity=velocity)).run(
        2.0, step=1e-3, initial_state={"update": paper.THETA}, every=10,
        inputs={"q_d": paper.SET_POINT, "pe": paper_excitation,
                **({} if velocity == "exact" else {"noise": 0.0})})
    assert np.max(np.abs(signal(run, "e_u"))) < 1e-12
    np.testing.assert_allclose(signal(run, "theta_hat")[:, -1], paper.THETA, atol=1e-12)


def lyapunov(run, gamma):
    """V of (A.1) along a run, with the true parameters."""
    e = signal(run, "q") - signal(run, "q_model")
    theta_err = signal(run, "theta_hat") - paper.THETA[:, None]
    a_bar, b_bar = A + B * paper.KD, B * paper.KP
    stiffness = b_bar * paper.KD**2 / paper.KP + paper.KP * (paper.KD / paper.KP * a_bar - 1)
    return 0.5 * (np.sum(signal(run, "e_u") ** 2 / paper.KP[:, None], axis=0)
                  + np.sum(theta_err**2, axis=0) / gamma
                  + np.sum(stiffness[:, None] * e**2, axis=0))


def test_lyapunov_function_never_rises_in_the_matched_loop(matched_run):
    v = lyapunov(matched_run, 80.0)
    assert np.all(np.diff(v) <= 1e-12 * v[0])
    assert v[-1] < 1e-9 * v[0]


def test_estimates_converge_to_the_true_parameters(matched_run):
    np.testing.assert_allclose(signal(matched_run, "theta_hat")[:, -1], paper.THETA, atol=1e-4)


def test_input_error_is_kp_e_plus_kd_de(matched_run):
    e = signal(matched_run, "q") - signal(matched_run, "q_model")
    de = signal(matched_run, "dq") - signal(matched_run, "dq_model")
    expected = paper.KP[:, None] * e + paper.KD[:, None] * de
    np.testing.assert_allclose(signal(matched_run, "e_u"), expected, atol=1e-12)


def test_composite_law_with_alpha_zero_is_the_plain_law():
    arm, inputs = paper.paper_arm(), {"q_d": paper.SET_POINT, "pe": paper_excitation}
    plain = compile_diagram(clie_loop(arm, paper.KP, paper.KD, 20.0)).run(
        3.0, step=1e-3, inputs=inputs, every=100)
    composite = compile_diagram(clie_composite(arm, paper.KP, paper.KD, 20.0, 0.0)).run(
        3.0, step=1e-3, inputs={**inputs, "noise": 0.0}, every=100)
    np.testing.assert_allclose(signal(plain, "theta_hat"), signal(composite, "theta_hat"),
                               rtol=1e-12)


def test_filtered_identification_error_vanishes_for_the_true_model():
    """(37), (38) need no acceleration: G2 on velocity and input is enough (with G1 left out)."""
    from clie_blocks.filters import lowpass, lowpass_with_rate
    from clie_blocks.identification import filtered_regressor, identification_error
    from clie_blocks.signals import interconnect

    plant = decoupled_joints(A, B, D)
    diagram = interconnect(
        [plant, lowpass_with_rate(2), lowpass(2, port="u"), filtered_regressor(2),
         identification_error(2)],
        [("lowpass_dq.dq", "plant.dq"), ("filtered_regressor.dq_f", "lowpass_dq.dq_f"),
         ("filtered_regressor.u_f", "lowpass.u_f"),
         ("identification_error.phi_f", "filtered_regressor.phi_f"),
         ("identification_error.y_f", "lowpass_dq.y_f")],
        inputs={"u": ["plant.u", "lowpass.u"], "theta_hat": "identification_error.theta_hat"},
        outputs={"e_f": "identification_error.e_f"}, unused=["plant.q"], name="filtered")
    run = compile_diagram(diagram).run(3.0, step=1e-3, every=10, inputs={
        "u": lambda t: np.array([np.sin(5 * t), np.cos(3 * t)]), "theta_hat": paper.THETA})
    assert np.max(np.abs(run.outputs)) < 1e-6


def test_feedback_linearisation_tracks_with_exact_parameters():
    loop = feedback_linearization(decoupled_joints(A, B, D), paper.THETA, paper.KP, paper.KD)
    run = compile_diagram(loop).run(20.0, step=1e-3, every=10, inputs={
        "q_d": paper.tracking_reference, "dq_d": paper.tracking_velocity,
        "ddq_d": paper.tracking_acceleration})
    error = signal(run, "q")[:, -1] - paper.tracking_reference(20.0)
    assert np.max(np.abs(error)) < 1e-6


def test_any_plant_with_the_same_ports_fits():
    """A plant with a load effect inside is a diagram with the plant's ports."""
    from clie_blocks.signals import interconnect, summing

    plant = decoupled_joints(A, B, D, name="bare")
    friction = ct.nlsys(None, lambda t, x, u, params: 0.1 * np.tanh(u / 0.01), dt=None,
                        name="friction", inputs=["dq[0]", "dq[1]"], outputs=["tau[0]", "tau[1]"])
    loaded = interconnect(
        [summing("u", "-tau", output="u", n=2, name="drive"), friction, plant],
        [("bare.u", "drive.u"), ("drive.tau", "friction.tau"), ("friction.dq", "bare.dq")],
        inputs={"u": "drive.u"}, outputs={"q": "bare.q", "dq": "bare.dq"}, name="plant")
    loop = clie_loop(loaded, paper.KP, paper.KD, 20.0)
    assert loop.nstates == matched().nstates
    program = compile_diagram(loop)
    x, u = np.full(loop.nstates, 0.1), np.ones(4)
    np.testing.assert_allclose(program.dynamics(0, x, u), loop.dynamics(0, x, u), rtol=1e-12)


def test_unknown_reading_names_the_nearest():
    with pytest.raises(DiagramError, match="did you mean 'measured'"):
        matched(velocity="mesured")


def test_recorded_loops_are_discrete_and_ordinary_systems():
    velocity = difference_filter(1, 1e-3, name="velocity")
    loop = recorded_loop([40.0], [5.0], 20.0, velocity)
    composite = recorded_composite([40.0], [5.0], 20.0, 1e-3, velocity)
    assert loop.dt == composite.dt == 1e-3
    assert "e_f[0]" in composite.output_labels and "theta_hat[2]" in str(loop)


def test_recorded_model_reproduces_a_sampled_robot_exactly():
    """Known truth: with the parameters of the sampled robot e_u is zero to round-off."""
    period, theta = 1e-3, np.array([2.0, 0.5, 0.1])
    velocity = difference_filter(1, period, name="velocity")
    loop = recorded_loop([40.0], [5.0], 20.0, velocity)
    q_d = 0.3 * np.sin(np.arange(400) * 0.01)
    log = sampled_robot(q_d, theta, period, 40.0, 5.0)
    u = np.vstack((log, q_d, np.zeros_like(q_d)))
    x_0 = np.zeros(loop.nstates)
    x_0[-3:] = theta
    run = ct.input_output_response(loop, np.arange(400) * period, u, x_0)
    assert np.max(np.abs(signal(run, "e_u"))) < 1e-10


def sampled_robot(q_d, theta, period, kp, kd):
    """Command log of one joint; the joint is integrated by scipy, not by our step."""
    from scipy.linalg import expm

    a, b, d = theta
    step = expm(np.array([[0, 1, 0], [0, -a, 1], [0, 0, 0]]) * period)
    x, older, log = np.zeros(2), [0.0, 0.0], []
    for wanted in q_d:
        dq = (x[0] - older[0]) / (2 * period)
        older = [older[1], x[0]]
        log.append(kp * (wanted - x[0]) - kd * dq)
        x = (step @ np.append(x, b * log[-1] - d))[:2]
    return np.array(log)


def test_pd_names_are_shared_on_purpose():
    loop = matched()
    assert {"kp", "kd", "update.gamma", "plant.a"} <= set(loop.params)
    assert not [key for key in loop.params if key.endswith("model.kp")]
    assert pd_controller([10.0], [5.0]).params.keys() == {"kp", "kd"}
