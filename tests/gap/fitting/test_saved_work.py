"""What the diagnosis does not simulate, because it knows already or would not use it."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.friction import COULOMB, PRESLIDING
from clie_blocks.analysis.gap.causes.load import SPRING
from clie_blocks.analysis.gap.fitting import levenberg_marquardt, refinement
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import (
    extended_jacobian,
    forward_jacobian,
    jacobian,
)
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.refinement import prune_joints
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.screening import base_motion, responses
from clie_blocks.analysis.gap.simulation import closed_loop
from clie_blocks.analysis.gap.simulation.batch_runs import WIDE, batch_signals


@pytest.fixture(scope="module")
def fitted(healthy):
    return fit_nominal(healthy, METHOD)


@pytest.fixture
def simulated(monkeypatch):
    """Logs that were simulated."""
    logs = []

    def counted(simulator, log, *made, **how):
        logs.append(log)
        return batch_signals(simulator, log, *made, **how)

    monkeypatch.setattr(closed_loop, "batch_signals", counted)
    return logs


def everywhere(cause, n, **values):
    sizes = {name: value * np.ones(n) for name, value in values.items()}
    return Member(cause, tuple(range(n)), sizes, sizes)


def test_a_fit_at_its_optimum_simulates_only_the_logs_that_judge(fitted, simulated):
    residuals, nominal = fitted
    best = fit(nominal.hypothesis, residuals, 30)
    simulated.clear()
    again = fit(best.hypothesis, residuals)
    assert again.iterations == 0
    assert simulated == list(best.hypothesis.problem.held_out)
    assert again.total == best.total


def test_a_fit_is_freed_from_idle_joints_once(fitted, healthy, simulated):
    residuals, nominal = fitted
    member = everywhere(COULOMB, healthy.n, level=1e-3 * np.abs(healthy.fit[0].u).max())
    found = fit(build_hypothesis(healthy, (member,), nominal.hypothesis), residuals, 2)
    first = prune_joints(found, residuals, nominal.excess)
    simulated.clear()
    assert prune_joints(found, residuals, nominal.excess) is first
    assert not simulated


def test_what_slopes_predict_of_a_joint_left_out_is_what_its_fit_leaves(case):
    made = case("coulomb")
    problem = Problem.from_logs(made.robot, made.records)
    residuals, nominal = fit_nominal(problem, METHOD)
    level = 0.1 * np.abs(problem.fit[0].u).max(axis=0)
    found = fit(build_hypothesis(problem, (everywhere(COULOMB, problem.n, level=level),),
                           nominal.hypothesis), residuals, 8)
    acting = int(np.argmax(found.hypothesis.values["coulomb.level"]))
    fewer = refinement._left_out(found.hypothesis, 0, [acting])
    if fewer is None:
        fewer = build_hypothesis(problem, (), found.hypothesis)
    predicted = refinement.predicted_refit_rise(fewer, found, residuals)
    assert predicted > 10.0
    assert fit(fewer, residuals, 3).excess - found.excess > 0.3 * predicted


def test_a_joint_that_is_predicted_to_be_needed_is_not_left_out(fitted, healthy):
    residuals, nominal = fitted
    size = 1e-3 * np.abs(healthy.fit[0].u).max()
    found = fit(build_hypothesis(healthy, (everywhere(COULOMB, healthy.n, level=size),),
                                 nominal.hypothesis), residuals, 0)
    needed = METHOD.with_values(**{"fitting.refit_rise_factor": -1e9,
                                   "fitting.slopes_valid_share": -1e9})
    assert prune_joints(found, residuals, nominal.excess) is not found
    strict = dataclasses.replace(residuals, method=needed)
    assert prune_joints(found, strict, nominal.excess) is found


def test_responses_that_come_one_by_one_are_those_of_each_set(fitted, healthy):
    centre, n = fitted[1].hypothesis, healthy.n
    motion, level = base_motion(centre), 0.02 * np.abs(healthy.fit[0].u).max()
    sets = [everywhere(PRESLIDING, n, level=level, reach=0.002 * k,
                       bristle_damping=level).values
            for k in range(1, WIDE + 3)]
    changes = list(responses(centre, motion, PRESLIDING, sets))
    assert len(changes) == len(sets)
    for values, change in zip(sets, changes):
        (alone,) = responses(centre, motion, PRESLIDING, [values])
        for one, other in zip(change, alone):
            np.testing.assert_array_equal(one, other)
            assert np.abs(one).max() > 0.0


def test_what_a_hypothesis_adds_to_a_fit_is_all_that_is_simulated_for_its_slopes(case):
    made = case("coulomb")
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    problem = nominal.hypothesis.problem
    rubbing = build_hypothesis(problem, (everywhere(COULOMB, problem.n, level=0.1),),
                               nominal.hypothesis)
    slack = Member(SPRING, rubbing.members[0].joints, {"stiffness": np.zeros(problem.n)},
                   {"stiffness": np.ones(problem.n)})
    more = build_hypothesis(problem, (*rubbing.members, slack), rubbing)
    whole = forward_jacobian(more, residuals)
    quick = extended_jacobian(more, rubbing, residuals)
    np.testing.assert_allclose(quick.columns, whole.columns, rtol=1e-5,
                               atol=1e-6 * np.abs(whole.columns).max())
    np.testing.assert_allclose(quick.residual, whole.residual, rtol=1e-9)


def test_slopes_that_are_borrowed_leave_the_end_of_a_fit_where_it_is(case):
    made = case("coulomb")
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    problem = nominal.hypothesis.problem
    start = build_hypothesis(problem, (everywhere(COULOMB, problem.n, level=1e-3),),
                             nominal.hypothesis)
    exact = forward_jacobian(start, residuals)
    borrowing = jacobian(start, residuals, nominal.hypothesis)
    np.testing.assert_allclose(borrowing.residual, exact.residual, rtol=1e-12)
    for i, parameter in enumerate(start.free_parameters):
        lender = nominal.hypothesis if parameter.of_robot else start
        own = forward_jacobian(lender, residuals)
        j = [one.key for one in lender.free_parameters].index(parameter.key) + parameter.joint
        np.testing.assert_allclose(borrowing.slopes[:, i], own.slopes[:, j], rtol=1e-9,
                                   atol=1e-9 * np.abs(exact.slopes[:, i]).max())
    ends = fit(start, residuals), fit(start, residuals, like=nominal.hypothesis)
    assert ends[1].cost == pytest.approx(ends[0].cost, abs=0.01 * ends[0].samples.sum())
    np.testing.assert_allclose(ends[1].spread, ends[0].spread, rtol=0.05)


def test_a_fit_that_only_borrows_simulates_what_is_added_and_improves(case, monkeypatch):
    made = case("coulomb")
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    problem = nominal.hypothesis.problem
    start = build_hypothesis(problem, (everywhere(COULOMB, problem.n, level=1e-3),),
                             nominal.hypothesis)
    lenders = []
    monkeypatch.setattr(levenberg_marquardt, "jacobian", lambda hypothesis, residuals, like=None: (
        lenders.append(like) or jacobian(hypothesis, residuals, like)))
    begun = fit(start, residuals, 8, nominal.hypothesis, borrows_only=True)
    assert set(lenders) == {nominal.hypothesis}
    unfitted = fit(start, residuals, 0, nominal.hypothesis)
    assert begun.cost < 0.9 * unfitted.cost
