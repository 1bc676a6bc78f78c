"""A cause that has shrunk to a simpler one gives its set a neighbour with that one."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES, drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.candidates import Candidate
from clie_blocks.analysis.gap.search.simpler import simpler_candidates
from clie_blocks.analysis.gap.search.steps import SEARCH_STEPS

GROWS = friction.LOAD_DEPENDENT_FRICTION[0]


@pytest.fixture(scope="module")
def rubbing(case):
    """Residual model and refitted nominal model of a robot with dry friction."""
    made = case("coulomb")
    return fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)


def set_of(nominal, *members, cost=10.0):
    """Fit of some causes, with a standard deviation of one of all its numbers."""
    start = build_hypothesis(nominal.hypothesis.problem, members, nominal.hypothesis)
    return dataclasses.replace(nominal, hypothesis=start, chi2=cost * nominal.samples,
                               spread=np.ones(len(start.free_parameters)))


def at_all_joints(nominal, cause, **values):
    n = nominal.hypothesis.problem.n
    arrays = {name: np.full(n, value) for name, value in values.items()}
    return Member(cause, tuple(range(n)), arrays, {name: np.full(n, 0.1) for name in values})


def keys(candidates):
    return [{one.cause.key for one in candidate.members} for candidate in candidates]


def test_friction_of_load_without_a_slope_beside_a_gain_is_coulomb_friction_beside_it(rubbing):
    residuals, nominal = rubbing
    gain = at_all_joints(nominal, drive.TORQUE_GAIN_ERROR, error=0.1)
    grows = set_of(nominal, at_all_joints(nominal, GROWS, level=0.07, share=0.0), gain)
    (found,) = simpler_candidates([grows], [grows], CAUSES, residuals)
    assert keys([found]) == [{"coulomb", "torque_gain_error"}]
    assert np.all(found.members[0].values["level"] == 0.07)
    assert found.extends is grows

    slope = set_of(nominal, at_all_joints(nominal, GROWS, level=0.07, share=0.05), gain)
    assert simpler_candidates([slope], [slope], CAUSES, residuals) == []
    others = [cause for cause in CAUSES if cause is not friction.COULOMB]
    assert simpler_candidates([grows], [grows], others, residuals) == []


def test_what_was_fitted_as_well_or_is_in_the_set_is_not_fitted_again(rubbing):
    residuals, nominal = rubbing
    shrunk = at_all_joints(nominal, GROWS, level=0.07, share=0.0)
    plain = at_all_joints(nominal, friction.COULOMB, level=0.07)
    grows, worse = set_of(nominal, shrunk), set_of(nominal, plain, cost=12.0)
    equal = set_of(nominal, plain)
    assert keys(simpler_candidates([grows], [grows, worse], CAUSES, residuals)) == [{"coulomb"}]
    assert simpler_candidates([grows], [grows, worse, equal], CAUSES, residuals) == []
    both = set_of(nominal, shrunk, plain)
    assert simpler_candidates([both], [both], CAUSES, residuals) == []


def test_the_simpler_set_explains_as_much_as_the_one_that_it_comes_from(rubbing):
    residuals, nominal = rubbing
    torque = np.sqrt(np.mean(nominal.hypothesis.problem.fit[0].u**2, axis=0))
    joints = tuple(range(nominal.hypothesis.problem.n))
    some = Member(GROWS, joints, {"level": 0.05 * torque, "share": 0.0 * torque},
                  {"level": 0.05 * torque, "share": 0.1 + 0.0 * torque})
    grows, = SEARCH_STEPS.race(residuals, nominal, [Candidate((some,), 1.0)], 1)
    assert grows.excess < 0.01 * nominal.excess
    found = simpler_candidates([grows], [grows], CAUSES, residuals)
    plain, = SEARCH_STEPS.race(residuals, nominal, found, 1)
    assert [member.cause for member in plain.hypothesis.members] == [friction.COULOMB]
    assert plain.cost == pytest.approx(grows.cost, rel=0.01)
