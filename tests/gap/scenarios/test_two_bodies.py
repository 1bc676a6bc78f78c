"""Motor and link that move apart, against the joint that does not and against finer steps."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import transmission
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis

SECONDS, FINER = 1.5, 50
# rad, between a joint that moves as one and its two bodies: their drag is that of the beginning of
# a step.  The noise of the sensor is 1e-4.
AS_ONE = 3e-5
CAUSES = transmission.BACKLASH, transmission.JOINT_ELASTICITY


@pytest.fixture(scope="module")
def short(healthy):
    """The first seconds of one log, without the measured noise."""
    log, rows = healthy.fit[0], round(SECONDS / healthy.period)
    cut = {key: getattr(log, key)[:rows] for key in ("q", "u", "q_d", "pe")}
    log = dataclasses.replace(log, **cut, dither=np.zeros_like(cut["q"]))
    return dataclasses.replace(healthy, fit=(log,), held_out=())


def member(problem, cause, **parameters):
    joints = tuple(range(problem.n))
    values = {"loose": 1.0, "link_share": 0.5, "bearing_share": 0.0, **parameters}
    values = {key: value + np.zeros(problem.n) for key, value in values.items()}
    return Member(cause, joints, values, values)


@pytest.mark.parametrize("cause", CAUSES, ids=lambda cause: cause.name)
def test_a_joint_that_is_not_loose_moves_as_one(short, cause):
    parameters = {number.name: 0.5 for number in cause.numbers}
    apart = member(short, cause, **{**parameters, "loose": 0.0})
    plain, rigid = build_hypothesis(short, ()), build_hypothesis(short, [apart])
    assert np.ptp(short.fit[0].q - plain.error(0)) > 0.01  # rad: it moves
    assert np.allclose(rigid.error(0), plain.error(0), rtol=0, atol=AS_ONE)


def test_backlash_is_that_of_two_bodies_in_fine_steps(short):
    """Second route: the same two bodies, one joint at a time, in steps fifty times as short."""
    half, contact = 2e-3, 300.0
    assert not short.links.has_gravity and not short.links.has_coupling  # one joint at a time
    backlash = member(short, transmission.BACKLASH, half_gap=half, contact=contact)
    loose = build_hypothesis(short, [backlash])
    simulated = short.fit[0].q - loose.error(0)
    rigid = short.fit[0].q - build_hypothesis(short, ()).error(0)
    for k in range(short.n):
        fine = _in_fine_steps(loose, k, half, contact)
        assert np.abs(fine - rigid[:, k]).max() > half / 4
        assert np.allclose(simulated[:, k], fine, rtol=0, atol=half / 50)


def _in_fine_steps(model, k, half, contact):
    problem, log = model.problem, model.problem.fit[0]
    law, h = problem.law, problem.period / FINER
    of = {key: model.values[key][k] for key in ("inertia", "damping", "load")}
    stated = problem.links.diagonal[k] / problem.gear_ratio[k]
    link = 0.5 * (stated if problem.links.known else of["inertia"])
    motor = of["inertia"] - link
    both = link * motor / (link + motor)
    b, a, memory = law.numerator[:, k], law.denominator[:, k], [0.0, 0.0]
    q = motor_q = log.start[k]
    dq = motor_dq = 0.0
    positions = []
    for q_d, pe in zip(log.q_d[:, k], log.pe[:, k]):
        positions.append(q)
        x = q - log.start[k]
        rate = b[0] * x + memory[0]
        memory = [b[1] * x - a[1] * rate + memory[1], b[2] * x - a[2] * rate]
        u = law.kp[k] * (q_d - q) - law.kd[k] * rate + pe
        for _ in range(FINER):
            twist, twisting = motor_q - q, motor_dq - dq
            depth = abs(twist) - half
            pushed = max(contact * depth + 2 * np.sign(twist) * twisting, 0.0)
            passed = np.sign(twist) * both * contact * pushed if depth > 0 else 0.0
            motor_dq += h * (u - of["load"] - of["damping"] * motor_dq - passed) / motor
            dq += h * passed / link
            motor_q, q = motor_q + h * motor_dq, q + h * dq
    return np.array(positions)
