"""Shares of several causes: closed forms of Shapley's value, and what simulated causes do."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.assessment.cause_shares import cause_shares, shares_of
from clie_blocks.analysis.gap.causes.friction import (
    ASYMMETRIC_COULOMB,
    COULOMB,
    QUADRATIC_DRAG,
    STRIBECK,
)
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem

NAMES = ("backlash", "coulomb", "gravity")
SETS = [frozenset(some) for count in range(4) for some in itertools.combinations(NAMES, count)]


def by_set(taken):
    """What each set takes."""
    return {some: taken(some) for some in SETS}


def test_causes_that_do_not_meet_take_what_they_take_alone():
    own = {"backlash": 0.5, "coulomb": 0.3, "gravity": 0.1}
    shares = cause_shares(NAMES, by_set(lambda some: sum(own[k] for k in some)))
    for name, share in shares.items():
        assert (share.alone, share.last, share.mean) == pytest.approx((own[name],) * 3)


def test_causes_that_do_the_same_share_it():
    shares = cause_shares(NAMES, by_set(
        lambda some: 0.9 if {"backlash", "coulomb"} & some else 0.0))
    for name in ("backlash", "coulomb"):
        assert shares[name].alone == pytest.approx(0.9)
        assert shares[name].last == pytest.approx(0.0, abs=1e-12)
        assert shares[name].mean == pytest.approx(0.45)
    assert shares["gravity"].mean == pytest.approx(0.0, abs=1e-12)


def test_causes_that_need_each_other_share_what_both_take():
    both = {"backlash", "coulomb"}
    taken = {some: 0.8 if both <= some else 0.0 for some in SETS if some <= both}
    shares = cause_shares(sorted(both), taken)
    assert [(one.alone, one.last, one.mean) for one in shares.values()] == [
        pytest.approx((0.0, 0.8, 0.4))] * 2


@given(st.lists(st.floats(-0.5, 1.5), min_size=7, max_size=7))
def test_the_mean_shares_add_up_to_what_all_take_together(taken):
    shares = cause_shares(NAMES, dict(zip(SETS, [0.0, *taken])))
    assert sum(one.mean for one in shares.values()) == pytest.approx(taken[-1], abs=1e-9)


@pytest.fixture
def healthy(case):
    """A healthy robot of three joints: residual model and refitted nominal model."""
    robot = case("none")
    problem = Problem.from_logs(robot.robot, robot.records)
    return fit_nominal(problem, METHOD)


def shares_of_members(residuals, nominal, *members):
    """Shares of causes that leave nothing of a gap of ten."""
    whole = build_hypothesis(residuals.problem, members, nominal.hypothesis)
    model = dataclasses.replace(fit(whole, residuals, 0), chi2=0.0 * nominal.chi2)
    gap = dataclasses.replace(nominal, chi2=11.0 * nominal.samples)
    return shares_of(model, gap, residuals)


def friction(size, *joints):
    """Coulomb friction at some joints."""
    level = {"level": np.full(3, size)}
    return Member(COULOMB, joints, level, level)


def drag(size, *joints):
    """Drag that grows with the squared speed."""
    coefficient = {"drag": np.full(3, size)}
    return Member(QUADRATIC_DRAG, joints, coefficient, coefficient)


def test_causes_of_two_joints_take_of_the_gap_what_they_do_to_the_motion(healthy):
    """They hardly meet, so that all three shares of each are nearly the same."""
    shares = shares_of_members(*healthy, friction(0.02, 0), drag(1e-4, 1))
    total = sum(one.mean for one in shares.values())
    assert total == pytest.approx(1.0, abs=1e-6)
    for share in shares.values():
        assert share.alone == pytest.approx(share.last, abs=0.02)
        assert share.mean == pytest.approx(share.last, abs=0.02)
        assert 0.0 < share.mean < 1.0


def test_a_cause_that_undoes_another_has_a_negative_share(healthy):
    shares = shares_of_members(*healthy, friction(0.02, 0),
                               Member(ASYMMETRIC_COULOMB, (0,), *[{
                                   "forward": np.full(3, -0.01),
                                   "backward": np.full(3, -0.01)}] * 2))
    assert shares["coulomb"].alone > 1.0 and shares["coulomb"].mean > 1.0
    assert shares["asymmetric_coulomb"].last < 0.0 and shares["asymmetric_coulomb"].mean < 0.0


def stribeck(level, excess, *joints):
    """Friction that rises at low speed."""
    values = {"level": np.full(3, level), "excess": np.full(3, excess),
              "velocity": np.full(3, 0.05)}
    return Member(STRIBECK, joints, values, values)


def test_a_share_says_what_the_simpler_cause_takes_that_a_cause_contains(healthy):
    """Coulomb friction with an excess of nothing is all of it, one without a level nothing."""
    for level, excess, part in ((0.02, 1e-9, 1.0), (1e-9, 0.02, 0.0)):
        share = shares_of_members(*healthy, stribeck(level, excess, 0), drag(1e-4, 1))["stribeck"]
        assert share.simpler == "coulomb" and share.last > 0.1
        assert share.as_simpler == pytest.approx(part * share.last, abs=1e-6)
    assert shares_of_members(*healthy, drag(1e-4, 1))["quadratic_drag"].simpler is None


def test_a_log_that_was_held_out_counts_as_much_as_a_fitted_one(case):
    """The joint model is that of the fitted logs, which hardly differs."""
    robot = case("none")
    shares = [shares_of_members(*fit_nominal(Problem.from_logs(
        robot.robot, robot.records, held_out=held_out), METHOD), friction(0.02, 0), drag(1e-4, 1))
        for held_out in ((), (0,))]
    for name in ("coulomb", "quadratic_drag"):
        assert shares[1][name].last == pytest.approx(shares[0][name].last, abs=0.03)
