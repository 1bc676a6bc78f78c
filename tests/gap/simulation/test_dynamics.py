"""The simulated loop: sticking, neutral causes, and the sensitivity that linearises it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.simulation import dynamics


def test_friction_stops_a_joint_and_never_turns_it_round():
    rates = np.linspace(-1.0, 1.0, 101)
    for rate in rates:
        after = dynamics.velocity_after_friction(np.array([rate]), np.array([2.0]), None,
                                  (np.array([0.4]), np.array([0.4])), 1.0)[0]
        assert after * rate >= 0.0
        assert abs(after) == pytest.approx(max(abs(rate) - 0.2, 0.0))


def test_friction_of_coupled_joints_leaves_the_other_joint_its_share():
    own, cross = np.array([2.0, 1.0]), np.array([[2.0, 0.3], [0.3, 1.0]])
    limits = np.array([10.0, 0.0]), np.array([10.0, 0.0])
    after = dynamics.velocity_after_friction(np.array([0.5, 0.1]), own, cross, limits, 1.0)
    mass = np.array([[2.0, 0.3], [0.3, 1.0]])
    momentum = mass @ (after - np.array([0.5, 0.1]))
    assert after[0] == pytest.approx(0.0, abs=1e-9)
    assert momentum[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("cause", [c for c in CAUSES if all(p.port != "transmission"
                                                            for p in c.pieces)],
                         ids=lambda cause: cause.key)
def test_a_neutral_cause_changes_nothing(cause, healthy):
    problem = healthy
    if cause.needs_links and not problem.chain.known:
        pytest.skip("this robot has no link data")
    values = {number.name: np.full(problem.n, 1.0 if number.neutral is None else number.neutral)
              for number in cause.numbers}
    plain = build_hypothesis(problem, ())
    with_it = build_hypothesis(problem, [Member(cause, tuple(range(problem.n)), values, values)])
    # switched off, a lag is one of a microsecond
    assert np.allclose(with_it.error(0), plain.error(0), rtol=0, atol=1e-6)


def test_the_sensitivity_is_the_derivative_of_the_simulated_loop(healthy):
    problem = healthy
    plain = build_hypothesis(problem, ())
    if problem.chain.has_gravity:  # the weight's own stiffness is not in S
        return
    load = 1e-3 * problem.law.kp
    loaded = plain.with_values({**plain.values, "load": plain.values["load"] + load})
    change = plain.error(0) - loaded.error(0)
    for k in range(problem.n):
        b, a = problem.law.torque_sensitivity(k, plain.values["inertia"][k],
                                  plain.values["damping"][k])
        expected = lfilter(b, a, np.full(len(change), -load[k]))
        assert np.allclose(change[:, k], expected, atol=2e-3 * np.abs(expected).max())
