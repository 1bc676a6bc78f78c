"""Whether a law of the user's own ran, and with which parameters."""

import dataclasses

import control as ct
import numpy as np
import pytest
from factories import make_problem

from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.problem.own_law import block_law, with_law_state
from clie_blocks.robot_loop.sampled_law import sampled_law

T, N = 0.01, 2
STATED = {"kp": np.array([40.0, 25.0]), "ki": np.array([9.0, 0.0]), "kd": np.array([6.0, 3.0]),
          "weight": np.array([0.0, 0.0]), "width": 0.1}
STEP = 1e-4  # N m, rounding of the command


def command(q_d, q, total, last, params):
    rate = (q - last) / T
    return (params["kp"] * (q_d - q) + params["ki"] * total - params["kd"] * rate
            + params["weight"] * np.cos(q) + 0.5 * np.tanh(rate / params["width"]))


def law():
    block = ct.nlsys(
        lambda t, x, u, params: np.concatenate((x[:N] + T * (u[:N] - u[N:]), u[N:])),
        lambda t, x, u, params: command(u[:N], u[N:], x[:N], x[N:], params),
        name="own", dt=T, states=2 * N, params=STATED,
        inputs=[f"{name}[{k}]" for name in ("q_d", "q") for k in range(N)],
        outputs=[f"u[{k}]" for k in range(N)])
    return block_law(sampled_law(block, T), np.zeros(N), np.full(N, np.inf), np.full(N, STEP))


def problem(**ran):
    """Three logs whose commands follow from parameters that may be others than stated."""
    params, own, logs = {**STATED, **ran}, law(), []
    t = T * np.arange(1500)[:, None]
    for j in range(3):
        q_d = np.array([0.5, 0.3]) * np.sin((1.1 + 0.4 * j) * t + [0.0, 1.0]) + 0.1 * np.sin(7 * t)
        q = q_d - 0.03 * np.sin((3.0 + j) * t + 0.3) - 0.02
        total, last, u = np.array([0.1, 0.05]), q[0], []
        for reference, position in zip(q_d, q):
            u.append(command(reference, position, total, last, params))
            total, last = total + T * (reference - position), position
        logs.append((q_d, q, np.rint(np.array(u) / STEP) * STEP))
    made = make_problem([q for _, q, _ in logs], period=T)
    made = dataclasses.replace(made, law=own)
    numbered = iter(logs)

    def driven(log):
        q_d, q, u = next(numbered)
        return with_law_state(dataclasses.replace(log, q_d=q_d, q=q, u=u), own)

    return made.with_logs(driven)


def test_the_law_that_ran_leaves_the_rounding():
    check = check_controller(problem())
    assert check.as_stated and not check.differences
    assert np.all(check.replay_error < 0.4 * STEP)


@pytest.mark.parametrize(("ran", "named"), [
    ({"kp": np.array([44.0, 25.0])}, {("kp", 0): 44.0}),
    ({"ki": np.array([0.0, 4.0])}, {("ki", 0): 0.0, ("ki", 1): 4.0}),
    ({"weight": np.array([0.0, 1.7])}, {("weight", 1): 1.7}),
    ({"width": 0.25}, {("width", None): 0.25}),
    ({"kd": np.array([5.0, 3.0]), "weight": np.array([-0.8, 0.0])},
     {("kd", 0): 5.0, ("weight", 0): -0.8})])
def test_parameters_that_ran_are_found_and_the_others_stay(ran, named):
    stated = problem(**ran)
    check = check_controller(stated)
    assert {(one.name, one.joint) for one in check.parameters} == set(named)
    for one in check.parameters:
        assert one.value == pytest.approx(named[one.name, one.joint], abs=1e-3)
    assert not check.as_stated and check.misdescribed and not check.unexplained
    corrected = check.corrected(stated)
    for log in corrected.logs:
        np.testing.assert_allclose(corrected.law.commands(log), log.u, atol=0.02)


def test_differences_are_told_joint_by_joint():
    check = check_controller(problem(kp=np.array([44.0, 20.0])))
    assert check.differences == (
        "joint 1: the law ran with kp 44 (stated 40); its description is wrong, or "
        "somebody changed the controller",
        "joint 2: the law ran with kp 20 (stated 25); its description is wrong, or "
        "somebody changed the controller")


def test_a_part_that_no_parameter_makes_is_left_as_unexplained():
    made = problem()
    t = T * np.arange(1500)
    strange = made.with_logs(lambda log: dataclasses.replace(
        log, u=log.u + np.outer(0.4 * np.sign(np.sin(23.0 * t)), [1.0, 0.0])))
    check = check_controller(strange)
    assert check.unexplained == (0,) and not check.parameters
    assert not check.as_stated


def test_models_follow_what_the_law_leaves():
    made = problem()
    added = np.outer(0.4 * np.sign(np.sin(0.23 * np.arange(1500))), [1.0, 0.0])
    strange = made.with_logs(lambda log: dataclasses.replace(log, u=log.u + added))
    followed = dataclasses.replace(check_controller(strange), recorded=True).corrected(strange)
    for log in followed.logs:
        assert np.abs(log.pe - added).max() < 2e-3 + 0.05 * np.abs(added).max()
