"""Starts, steps and the choice of logs that the search rests on."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.jacobian import Tangent, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import damped_step
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal, pool_logs
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import problem
from clie_blocks.analysis.gap.search.alternatives import alternatives
from clie_blocks.analysis.gap.search.candidates import Candidate, extensions


@pytest.fixture(scope="module")
def rubbing(case):
    """Bench and refitted nominal model of a robot with dry friction."""
    made = case("coulomb")
    return fit_nominal(problem(made.robot, made.records), METHOD)


def dry(n, level):
    return Member(friction.COULOMB, tuple(range(n)), {"level": np.full(n, level)},
                  {"level": np.full(n, level)})


def test_all_logs_are_learned_from_where_the_judging_one_holds_the_gap(rubbing):
    _, base = rubbing
    asked = base.hypothesis.problem
    silent = np.array(base.samples)
    assert pool_logs(asked, dataclasses.replace(base, chi2=silent), METHOD) is asked
    loud = silent.copy()
    loud[len(asked.fit):] *= 10.0
    wide = pool_logs(asked, dataclasses.replace(base, chi2=loud), METHOD)
    assert wide.fit == asked.logs and wide.held_out == ()
    assert pool_logs(asked, dataclasses.replace(base, chi2=10.0 * silent), METHOD) is asked


def test_a_start_is_no_worse_than_what_it_extends(rubbing):
    bench, base = rubbing
    level = 3.0 * np.abs(np.concatenate([log.u for log in base.hypothesis.problem.fit])).max()
    start = initial_guess(Candidate((dry(base.hypothesis.problem.n, level),), 0.0), bench, base)
    alone = build_hypothesis(base.hypothesis.problem,
                       (dry(base.hypothesis.problem.n, level),), base.hypothesis)
    assert jacobian(start, bench).cost < jacobian(alone, bench).cost


def test_a_step_of_some_keys_leaves_the_others(rubbing):
    bench, base = rubbing
    at = build_hypothesis(base.hypothesis.problem, (), None)
    moved = damped_step(at, jacobian(at, bench), keys=("damping",))
    assert np.array_equal(moved.values["inertia"], at.values["inertia"])
    assert not np.array_equal(moved.values["damping"], at.values["damping"])


def test_a_step_changes_a_time_or_a_range_by_a_factor_and_other_numbers_as_far_as_it_says(rubbing):
    bench, base = rubbing
    zero = np.zeros(base.hypothesis.problem.n)
    values = {"level": zero + 0.02, "bristle_damping": zero, "range": zero + 0.01}
    bristles = Member(friction.PRESLIDING, (0,), values, {key: zero + 0.01 for key in values})
    at = build_hypothesis(base.hypothesis.problem, (bristles,), base.hypothesis)
    for pull in (-1e3, 1e3):
        columns = np.eye(len(at.free_parameters) + 1, len(at.free_parameters))
        residual = -pull * columns.sum(axis=1)
        here = Tangent([], np.append(residual, 0 * at.prior_violations()),
                       np.vstack([columns, np.zeros((len(at.free_parameters), len(at.free_parameters)))]))
        moved = damped_step(at, here).values
        assert moved["presliding.range"][0] == pytest.approx(0.01 * 2.5 ** np.sign(pull))
        assert moved["presliding.level"][0] == pytest.approx(0.0 if pull < 0 else 0.08)


def test_a_wider_friction_takes_the_place_of_the_one_inside_it(rubbing):
    bench, base = rubbing
    n = base.hypothesis.problem.n
    zero = np.zeros(n)
    first = dataclasses.replace(base, hypothesis=build_hypothesis(
        base.hypothesis.problem, (dry(n, 0.1),), base.hypothesis))
    more = Member(friction.STRIBECK, tuple(range(n)),
                  {"level": zero + 0.02, "excess": zero + 0.05, "speed": zero + 0.03},
                  {"level": zero + 0.02, "excess": zero + 0.05, "speed": zero + 0.03})
    found, = extensions(first, [Candidate((more,), 1.0)])
    assert [member.cause.name for member in found.members] == ["stribeck"]
    assert np.allclose(found.members[0].values["level"], 0.12)


def test_each_of_two_causes_must_show_that_it_is_needed(rubbing):
    bench, base = rubbing
    n = base.hypothesis.problem.n
    gain = Member(drive.TORQUE_GAIN_ERROR, tuple(range(n)), {"error": np.full(n, 0.1)},
                  {"error": np.full(n, 0.1)})
    both = dataclasses.replace(base, hypothesis=build_hypothesis(
        base.hypothesis.problem, (dry(n, 0.1), gain), base.hypothesis))
    names = [{member.cause.name for member in one.members}
             for one in alternatives(both, [both], (friction.COULOMB,), bench)]
    assert {"coulomb"} in names and {"torque_gain_error"} in names
