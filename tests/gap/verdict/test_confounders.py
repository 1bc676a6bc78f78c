"""Rivals: where a fault, a ripple or two torques of the pose may be something foreign."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.causes import drive, friction, load, timed
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.verdict.confounders import (
    CONTACT,
    SOFT_STOP,
    are_separable,
    confounder,
)

PERIOD = 0.01
NEVER = 1e9


def holding(*members, values=None, gear=50.0, courses=None):
    """Stand-in of a fit: members, their numbers, and courses (N, 2) of the logs."""
    if courses is None:
        courses = [np.linspace(0.0, 0.5, 9)[:, None] * np.ones(2)] * 2
    logs = tuple(Course(q) for q in courses)
    problem = SimpleNamespace(fit=logs[:2], logs=logs, n=2, period=PERIOD,
                              gear_ratio=np.array([gear, gear]))
    return SimpleNamespace(hypothesis=SimpleNamespace(members=members, values=values or {},
                                                      problem=problem))


class Course:
    """Stand-in of a log."""

    def __init__(self, q):
        self.q = self.u = q

    def __len__(self):
        return len(self.q)


def rippled(order, size, gear=50.0):
    member = Member(drive.TORQUE_RIPPLE, (0, 1), {}, {})
    return holding(member, gear=gear, values={
        "torque_ripple.order": np.array(order), "torque_ripple.sine": np.array(size),
        "torque_ripple.cosine": np.zeros(2)})


@pytest.mark.parametrize("order, gear, shown", [
    (8.0, 50.0, False), (13.0, 50.0, False), (13.0, 14.0, True), (26.0, 50.0, True),
    (50.0, 50.0, True)])
def test_a_ripple_must_show_a_wave_of_the_motor_or_come_back(order, gear, shown):
    assert (confounder(rippled([order, 60.0], [1.0, 0.0], gear)) == "") is shown


def test_one_joint_that_shows_a_ripple_is_enough_unless_it_is_idle():
    assert confounder(rippled([8.0, 60.0], [1.0, 0.5])) == ""
    assert confounder(rippled([8.0, 60.0], [1.0, 0.01])) == SOFT_STOP


def test_a_spring_and_a_weight_bend_together_like_any_torque_of_the_pose():
    spring, weight = (Member(cause, (0,), {}, {}) for cause in (load.SPRING, load.GRAVITY))
    rubs = Member(friction.COULOMB, (0,), {}, {})
    assert confounder(holding(spring, weight)) == confounder(holding(rubs, weight, spring)) == SOFT_STOP
    assert confounder(holding(spring)) == confounder(holding(weight, rubs)) == confounder(holding(rubs)) == ""


T = PERIOD * np.arange(1000)
SWAY = np.stack([np.sin(T), np.cos(2.3 * T)], axis=1)  # to and fro, 10 s
HELD = np.where(T < 8.0, np.sin(T), 1.2)[:, None] * np.ones(2)  # rests beyond all its places


def faulted(courses, *moments, torque=(1.0, 0.0), cause=timed.STEP_FAULT[0]):
    name = cause.numbers[0].name
    member = Member(cause, (0, 1), {}, {name: np.ones(2)})
    return holding(member, courses=courses, values={
        f"{member.name}.{name}": np.array(torque),
        f"{member.name}.onset": np.array(moments)[:, None] * np.ones(2)})


def test_a_fault_that_sets_in_while_the_robot_comes_and_goes_has_no_rival():
    assert confounder(faulted([SWAY] * 3, 4.0, 4.0, 4.0)) == ""
    assert confounder(faulted([HELD, SWAY, SWAY], 3.0, NEVER, NEVER)) == ""


@pytest.mark.parametrize("cause", timed.STEP_FAULT[:3])
def test_a_fault_that_is_met_at_one_place_alone_may_be_something_in_the_way(cause):
    assert confounder(faulted([HELD, SWAY, SWAY], 8.0, NEVER, NEVER, cause=cause)) == CONTACT


def test_what_stands_in_the_way_pushes_back():
    assert confounder(faulted([HELD, SWAY, SWAY], 8.0, NEVER, NEVER, torque=(-1.0, 0.0))) == ""
    assert confounder(faulted([-HELD, SWAY, SWAY], 8.0, NEVER, NEVER, torque=(-1.0, 0.0))) == CONTACT


def test_a_log_that_goes_beyond_the_place_without_the_fault_clears_it():
    assert confounder(faulted([HELD, 1.01 * HELD, SWAY], 8.0, NEVER, NEVER)) == ""
    assert confounder(faulted([HELD, 0.99 * HELD, SWAY], 8.0, NEVER, NEVER)) == CONTACT


def test_a_short_way_beyond_the_place_is_not_overlooked_in_a_long_log():
    calm = np.tile(0.5 * SWAY, (30, 1))
    short = calm.copy()
    short[12345] = 1.5  # beyond where the first log rests
    assert confounder(faulted([HELD, calm, calm], 8.0, NEVER, NEVER)) == CONTACT
    assert confounder(faulted([HELD, short, calm], 8.0, NEVER, NEVER)) == ""


def test_a_fault_that_never_sets_in_or_always_was_has_no_rival():
    assert confounder(faulted([HELD] * 3, NEVER, NEVER, NEVER)) == ""
    assert confounder(faulted([HELD] * 3, 0.0, 0.0, 0.0)) == ""


@given(st.integers(1, 4), st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_places_on_two_sides_of_a_plane_are_apart_in_any_number_of_joints(n, seed, between):
    rng = np.random.default_rng(seed)
    across = rng.normal(size=n)
    across /= np.abs(across).max()
    places = rng.uniform(-1.0, 1.0, (200, n))
    places -= np.outer(places @ across, across) / (across @ across)  # on the plane
    well = places - np.outer(rng.uniform(0.0, 1.0, 200), across) / (across @ across)
    ill = places[::-1] + np.outer(rng.uniform(0.0, 1.0, 200) + between, across) / (across @ across)
    assert are_separable(ill, well, np.zeros(n))
    assert not are_separable(np.concatenate([ill, well]), well, np.zeros(n))
