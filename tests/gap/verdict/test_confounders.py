"""Confounders: where a fault, a ripple or two torques of the pose may be something else."""

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem, make_residual_model
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.causes import drive, friction, load, timed
from clie_blocks.analysis.gap.method import METHOD as WHOLE_METHOD
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.verdict.confounders import (
    CONTACT,
    POSE,
    UNMARKED,
    are_separable,
)
from clie_blocks.analysis.gap.verdict.confounders import confounder as confounder_by

PERIOD = 0.01
NEVER = 1e9
METHOD = VerdictMethod()
RAMPS = [np.linspace(0.0, 0.5, 9)[:, None] * np.ones(2)] * 3


# Nothing is compared before a fault sets in: the problems here have no robot behind them.
UNCOMPARED = WHOLE_METHOD.with_values(**{"verdict.least_rows_before": 10**9})


def confounder(fit):
    return confounder_by(fit, make_residual_model(fit.hypothesis.problem, method=UNCOMPARED))


def holding(*causes):
    """Fit of some causes on a ramp."""
    problem = make_problem(RAMPS)
    return make_fit(problem, *(make_member(cause, problem) for cause in causes))


def rippled(order, size, gear=50.0, cause=drive.TORQUE_RIPPLE):
    problem = make_problem(RAMPS, gear_ratio=gear)
    return make_fit(problem, make_member(cause, problem, order=np.array(order),
                                         sine=np.array(size), cosine=0.0))


@pytest.mark.parametrize("cause, size", [(drive.TORQUE_RIPPLE, 1.0),
                                         (drive.COMMUTATION_RIPPLE, 0.15)])
@pytest.mark.parametrize("order, gear, shown", [
    (8.0, 50.0, False), (13.0, 50.0, False), (13.0, 14.0, True), (26.0, 50.0, True),
    (50.0, 50.0, True), (13.0, 1.0, False), (26.0, 1.0, True)])
def test_a_ripple_must_show_a_wave_of_the_motor_or_come_back(order, gear, shown, cause, size):
    assert (confounder(rippled([order, 60.0], [size, 0.0], gear, cause)) == "") is shown


def test_one_joint_that_shows_a_ripple_is_enough_unless_it_is_idle():
    assert confounder(rippled([8.0, 60.0], [1.0, 0.5])) == ""
    assert confounder(rippled([8.0, 60.0], [1.0, 0.01])) == POSE


def test_a_spring_and_a_weight_bend_together_like_any_torque_of_the_pose():
    spring, weight, rubs = load.SPRING, load.GRAVITY, friction.COULOMB
    for causes in ([spring, weight], [rubs, weight, spring]):
        assert confounder(holding(*causes)) == POSE
    for causes in ([spring], [rubs], [spring, rubs]):
        assert confounder(holding(*causes)) == ""


T = PERIOD * np.arange(1000)
SWAY = np.stack([np.sin(T), np.cos(2.3 * T)], axis=1)  # to and fro, 10 s
HELD = np.where(T < 8.0, np.sin(T), 1.2)[:, None] * np.ones(2)  # rests beyond all its positions


def faulted(courses, *moments, torque=(1.0, 0.0), cause=timed.STEP_FAULT[0]):
    problem = make_problem(courses)
    onset = np.array(moments)[:, None] * np.ones(2)
    amplitude = {cause.numbers[0].name: np.array(torque)}
    return make_fit(problem, make_member(cause, problem, onset=onset, **amplitude))


def test_a_fault_that_sets_in_while_the_robot_comes_and_goes_has_no_confounder():
    assert confounder(faulted([SWAY] * 3, 4.0, 4.0, 4.0)) == ""
    assert confounder(faulted([HELD, SWAY, SWAY], 3.0, NEVER, NEVER)) == ""


@pytest.mark.parametrize("cause", timed.STEP_FAULT[:3])
def test_a_fault_that_is_met_at_one_position_alone_may_be_something_in_the_way(cause):
    assert confounder(faulted([HELD, SWAY, SWAY], 8.0, NEVER, NEVER, cause=cause)) == CONTACT


def test_what_stands_in_the_way_pushes_back():
    helping, opposing = (faulted([course, SWAY, SWAY], 8.0, NEVER, NEVER, torque=(-1.0, 0.0))
                         for course in (HELD, -HELD))
    assert confounder(helping) == "" and confounder(opposing) == CONTACT


def test_a_log_that_goes_beyond_the_place_without_the_fault_clears_it():
    assert confounder(faulted([HELD, 1.01 * HELD, SWAY], 8.0, NEVER, NEVER)) == ""
    assert confounder(faulted([HELD, 0.99 * HELD, SWAY], 8.0, NEVER, NEVER)) == CONTACT


def test_a_short_way_beyond_the_place_is_not_overlooked_in_a_long_log():
    calm = np.tile(0.5 * SWAY, (30, 1))
    short = calm.copy()
    short[12345] = 1.5  # beyond where the first log rests
    assert confounder(faulted([HELD, calm, calm], 8.0, NEVER, NEVER)) == CONTACT
    assert confounder(faulted([HELD, short, calm], 8.0, NEVER, NEVER)) == ""


def test_a_fault_that_never_sets_in_has_no_confounder_and_one_that_always_was_no_mark():
    assert confounder(faulted([HELD] * 3, NEVER, NEVER, NEVER)) == ""
    assert confounder(faulted([HELD] * 3, 0.0, 0.0, 0.0)) == UNMARKED


@pytest.mark.slow
@given(st.integers(1, 4), st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_positions_on_two_sides_of_a_plane_are_apart_in_any_number_of_joints(n, seed, between):
    rng = np.random.default_rng(seed)
    across = rng.normal(size=n)
    across /= np.abs(across).max()
    positions = rng.uniform(-1.0, 1.0, (200, n))
    positions -= np.outer(positions @ across, across) / (across @ across)  # on the plane
    well = positions - np.outer(rng.uniform(0.0, 1.0, 200), across) / (across @ across)
    away = rng.uniform(0.0, 1.0, 200) + between
    ill = positions[::-1] + np.outer(away, across) / (across @ across)
    tolerance = METHOD.yielding
    assert are_separable(ill, well, np.zeros(n), tolerance)
    assert not are_separable(np.concatenate([ill, well]), well, np.zeros(n), tolerance)
