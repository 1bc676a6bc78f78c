"""The simulated loop: sticking, neutral causes, and the sensitivity that linearises it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.robot_loop import dynamics
from clie_blocks.robot_loop.links import mass_rows, planar_links


def test_friction_stops_a_joint_and_never_reverses_it():
    limits = np.array([0.4]), np.array([0.4])
    for rate in np.linspace(-1.0, 1.0, 101):
        after = dynamics.velocity_after_friction(np.array([rate]), np.array([2.0]), None, limits,
                                                 1.0)[0]
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


@pytest.fixture(scope="module")
def healthy_with_links(case):
    """Problem of a healthy robot whose link data are stated."""
    made = case("none", seed=1)
    problem = Problem.from_logs(made.robot, made.records)
    assert problem.links.known
    return problem


@pytest.mark.parametrize("cause", [c for c in CAUSES if all(p.port != "transmission"
                                                            for p in c.pieces)],
                         ids=lambda cause: cause.key)
def test_a_neutral_cause_changes_nothing(cause, healthy, healthy_with_links):
    problem = healthy_with_links if cause.needs_links else healthy
    values = {number.name: np.full(problem.n, 1.0 if number.neutral is None else number.neutral)
              for number in cause.numbers}
    plain = build_hypothesis(problem, ())
    member = Member(cause, tuple(range(problem.n)), values, values)
    with_cause = build_hypothesis(problem, [member])
    # a lag that is switched off is one of a microsecond
    assert np.allclose(with_cause.error(0), plain.error(0), rtol=0, atol=1e-6)


def test_the_sensitivity_is_the_derivative_of_the_simulated_loop(healthy):
    problem, plain = healthy, build_hypothesis(healthy, ())
    assert not problem.links.has_gravity  # whose stiffness is not in S
    load = 1e-3 * problem.law.kp
    loaded = plain.with_values({**plain.values, "load": plain.values["load"] + load})
    change = plain.error(0) - loaded.error(0)
    for k in range(problem.n):
        b, a = problem.law.torque_sensitivity(k, plain.values["inertia"][k],
                                              plain.values["damping"][k])
        expected = lfilter(b, a, np.full(len(change), -load[k]))
        assert np.allclose(change[:, k], expected, atol=2e-3 * np.abs(expected).max())


@pytest.fixture(params=[2, 4, 6])
def chain(request):
    n, rng = request.param, np.random.default_rng(1)
    length, mass = rng.uniform(0.2, 0.5, n), rng.uniform(0.3, 1.2, n)
    return planar_links(length, mass, 0.6 * length, 0.05 * mass * length**2, has_gravity=True,
                        has_coupling=True, diagonal=np.linspace(0.5, 0.1, n))


def test_the_acceleration_solves_the_equation_of_a_chain_behind_gears(chain):
    ratio, rng = np.linspace(3.0, 50.0, chain.n), np.random.default_rng(4)
    rows = mass_rows(chain, rng.normal(size=chain.n))
    rotor, torque = 1e-3 * ratio, rng.normal(size=chain.n)
    own, cross = dynamics.split_mass(rows)
    acceleration = dynamics.acceleration(torque, rotor + own / ratio, cross / ratio)
    matrix = np.diag(rotor) + np.array(rows) / ratio[:, None]
    assert np.allclose(acceleration, np.linalg.solve(matrix, torque), rtol=1e-9)


def test_stuck_joints_of_a_chain_stay_stuck_and_slipping_ones_feel_their_whole_friction(chain):
    n = chain.n
    own, cross = dynamics.split_mass(mass_rows(chain, np.linspace(-1.0, 0.7, n)))
    own, dq = own + 0.3, np.linspace(0.3, 1.0, n)
    limits = np.where(np.arange(n) % 2, 1e-3, 10.0)
    after = dynamics.velocity_after_friction(dq, own, cross, (limits, limits), 1.0)
    matrix = cross + 0.3 * np.eye(n)
    impulse = matrix @ (dq - after)
    stuck = np.arange(n) % 2 == 0
    assert np.allclose(after[stuck], 0.0, atol=2e-3)
    assert np.allclose(impulse[~stuck], 1e-3, rtol=1e-6)
