"""The paper's arm as a loop of two coupled joints; the truth comes from solve_ivp."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation.simulators import simulator_of
from clie_blocks.analysis.records import Record
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.manipulator import two_link_arm

ARM = {"mass": [4.0, 3.0], "length": [0.5, 0.4], "gear_ratio": [10.0, 10.0],
       "j_motor": [6e-3, 5e-3], "b_motor": [0.02, 0.02]}
KP, KD, PERIOD, NOISE = np.array([6.0, 5.0]), np.array([0.9, 0.7]), 4e-3, 3e-5
TIME = PERIOD * np.arange(2500)
OPPOSING = {  # torque that the loop does not have, motor side
    "none": lambda t, q, dq: np.zeros(2),
    "coulomb": lambda t, q, dq: np.array([0.0, 0.06 * np.tanh(dq[1] / 1e-3)]),
    "spring": lambda t, q, dq: np.array([0.5 * q[0], 0.0]),
}


def arm_loop():
    """Fig. 1 with the arm: its joints are coupled by the links."""
    return joint_loop(two_link_arm(**ARM), KP, KD)


def drive(k):
    """Set-points and excitation of experiment k, shape (N, 2)."""
    q_d = np.stack([0.5 * np.sin(2 * np.pi * 0.11 * (1 + k / 5) * TIME),
                    0.6 * np.sin(2 * np.pi * 0.17 * (1 + k / 7) * TIME)], axis=1)
    tones = np.array([0.23, 0.61, 1.3, 2.4]) * (1.0, 1.17, 0.9)[k]
    return q_d, np.stack([0.3 * np.sin(2 * np.pi * np.outer(TIME, tones * f) + 2.0 * k).sum(1)
                          for f in (1.0, 1.31)], axis=1)


def logged(name, k):
    """Log of the true arm: inputs held over a sample."""
    plant, (q_d, pe) = two_link_arm(**ARM), drive(k)
    noise = np.random.default_rng(k).normal(0, NOISE, q_d.shape)

    def command(i, x):
        return KP * (q_d[i] - x[:2] - noise[i]) - KD * x[2:4] + pe[i]

    def rate(t, x):
        i = min(int(t / PERIOD + 1e-9), len(TIME) - 1)
        torque = command(i, x) - OPPOSING[name](t, x[:2], x[2:4])
        return plant.updfcn(t, x, torque, plant.params)

    states = solve_ivp(rate, (0, TIME[-1]), np.zeros(4), t_eval=TIME, max_step=PERIOD,
                       method="RK23", rtol=1e-6, atol=1e-9).y.T
    u = np.stack([command(i, x) for i, x in enumerate(states)])
    return Record(time=TIME, q=states[:, :2] + noise, u=u, qd=q_d, pe=pe, source=f"log-{k + 1}")


@pytest.mark.slow
def test_the_loop_is_replayed_down_to_the_noise():
    log = logged("none", 0)
    problem = Problem.from_loop(arm_loop(), [log])
    law = problem.law
    values = {"inertia": law.inertia, "damping": law.damping, "load": np.zeros(2)}
    q, u = simulator_of(problem, ()).run(problem.fit[0], values)
    settled = slice(500, None)  # the start is known as well as the first sample only
    assert np.std((q - log.q)[settled], axis=0) == pytest.approx(NOISE, rel=0.1)
    assert np.std((u - log.u)[settled], axis=0) == pytest.approx(KP * NOISE, rel=0.1)


@pytest.mark.parametrize("name, joints", [
    ("coulomb", (1,)), ("spring", (0,)), ("none", None)])
@pytest.mark.slow
def test_the_right_joint_of_a_coupled_arm_is_named(name, joints):
    diagnosis = diagnose(Problem.from_loop(arm_loop(), [logged(name, k) for k in range(2)]))
    assert diagnosis.ranking[0].names == (name,)
    if joints:
        (member,) = diagnosis.ranking[0].fit.hypothesis.members
        assert member.joints == joints
