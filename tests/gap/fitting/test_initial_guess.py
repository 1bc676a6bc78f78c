"""Starts, steps and the choice of logs that the search rests on."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.jacobian import Tangent, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import damped_step, fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal, pool_logs
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.alternatives import alternatives
from clie_blocks.analysis.gap.search.candidates import Candidate, extensions, fitted_members

FITTING = METHOD.fitting


@pytest.fixture(scope="module")
def rubbing(case):
    """Bench and refitted nominal model of a robot with dry friction."""
    made = case("coulomb")
    return fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)


def dry(n, level):
    return Member(friction.COULOMB, tuple(range(n)), {"level": np.full(n, level)},
                  {"level": np.full(n, level)})


def test_all_logs_are_learned_from_where_the_judging_one_holds_the_gap(rubbing):
    _, nominal = rubbing
    asked = nominal.hypothesis.problem
    silent = np.array(nominal.samples)
    assert pool_logs(asked, dataclasses.replace(nominal, chi2=silent), METHOD) is asked
    loud = silent.copy()
    loud[len(asked.fit):] *= 10.0
    wide = pool_logs(asked, dataclasses.replace(nominal, chi2=loud), METHOD)
    assert wide.fit == asked.logs and wide.held_out == ()
    assert pool_logs(asked, dataclasses.replace(nominal, chi2=10.0 * silent), METHOD) is asked


def test_a_start_is_no_worse_than_what_it_extends(rubbing):
    residuals, nominal = rubbing
    problem = nominal.hypothesis.problem
    level = 3.0 * np.abs(np.concatenate([log.u for log in problem.fit])).max()
    members = (dry(problem.n, level),)
    start = initial_guess(Candidate(members, 0.0), residuals, nominal)
    alone = build_hypothesis(problem, members, nominal.hypothesis)
    assert jacobian(start, residuals).cost < jacobian(alone, residuals).cost


def test_a_start_has_the_joint_model_of_a_leader_that_explains_the_gap(rubbing):
    residuals, nominal = rubbing
    problem = nominal.hypothesis.problem
    members = (dry(problem.n, 1e-3),)
    leader = fit(build_hypothesis(problem, members, nominal.hypothesis), residuals)
    candidate = Candidate(tuple(fitted_members(leader.hypothesis)), 0.0)
    start = initial_guess(candidate, residuals, nominal, leader)
    assert np.array_equal(start.values["inertia"], leader.hypothesis.values["inertia"])
    heavy = dataclasses.replace(leader, hypothesis=leader.hypothesis.with_values(
        {**leader.hypothesis.values, "inertia": 3.0 * leader.hypothesis.values["inertia"]}))
    start = initial_guess(candidate, residuals, nominal, heavy)
    assert np.all(start.values["inertia"] < 2.0 * leader.hypothesis.values["inertia"])


def test_a_step_of_some_keys_leaves_the_others(rubbing):
    residuals, nominal = rubbing
    at = build_hypothesis(nominal.hypothesis.problem, (), None)
    moved = damped_step(at, jacobian(at, residuals), FITTING, FITTING.cautious_damping,
                        ("damping",))
    assert np.array_equal(moved.values["inertia"], at.values["inertia"])
    assert not np.array_equal(moved.values["damping"], at.values["damping"])


def test_a_step_changes_a_time_or_a_range_by_a_factor_and_other_numbers_as_far_as_it_says(rubbing):
    residuals, nominal = rubbing
    zero = np.zeros(nominal.hypothesis.problem.n)
    values = {"level": zero + 0.02, "bristle_damping": zero, "reach": zero + 0.01}
    bristles = Member(friction.PRESLIDING, (0,), values, {key: zero + 0.01 for key in values})
    at = build_hypothesis(nominal.hypothesis.problem, (bristles,), nominal.hypothesis)
    for pull in (-1e3, 1e3):
        free = len(at.free_parameters)
        columns = np.eye(free + 1, free)
        of_logs = -pull * columns.sum(axis=1)
        tangent = Tangent([of_logs], np.append(of_logs, np.zeros(free)),
                          np.vstack([columns, np.zeros((free, free))]))
        moved = damped_step(at, tangent, FITTING, FITTING.cautious_damping).values
        assert moved["presliding.reach"][0] == pytest.approx(0.01 * 2.5 ** np.sign(pull))
        assert moved["presliding.level"][0] == pytest.approx(0.0 if pull < 0 else 0.08)


def test_a_wider_friction_takes_the_place_of_the_one_inside_it(rubbing):
    residuals, nominal = rubbing
    n = nominal.hypothesis.problem.n
    zero = np.zeros(n)
    first = dataclasses.replace(nominal, hypothesis=build_hypothesis(
        nominal.hypothesis.problem, (dry(n, 0.1),), nominal.hypothesis))
    more = Member(friction.STRIBECK, tuple(range(n)),
                  {"level": zero + 0.02, "excess": zero + 0.05, "velocity": zero + 0.03},
                  {"level": zero + 0.02, "excess": zero + 0.05, "velocity": zero + 0.03})
    found, = extensions(first, [Candidate((more,), 1.0)])
    assert [member.cause.name for member in found.members] == ["stribeck"]
    assert np.allclose(found.members[0].values["level"], 0.12)


def test_each_of_two_causes_must_show_that_it_is_needed(rubbing):
    residuals, nominal = rubbing
    n = nominal.hypothesis.problem.n
    gain = Member(drive.TORQUE_GAIN_ERROR, tuple(range(n)), {"error": np.full(n, 0.1)},
                  {"error": np.full(n, 0.1)})
    both = dataclasses.replace(nominal, hypothesis=build_hypothesis(
        nominal.hypothesis.problem, (dry(n, 0.1), gain), nominal.hypothesis))
    names = [{member.cause.name for member in one.members}
             for one in alternatives(both, [both], (friction.COULOMB,), residuals)]
    assert {"coulomb"} in names and {"torque_gain_error"} in names
