"""Numbers of the robot file in the place of the effects that they pass for."""

import numpy as np
from factories import make_member, make_problem

from clie_blocks.analysis.gap.causes import drive, friction, load
from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.causes.description import (
    CHANGE,
    COM,
    INERTIA,
    LENGTH,
    MASS,
    PARAMETRIC,
)
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.search.file_numbers import (
    with_coupled_number,
    with_swapped_number,
    wrong_numbers,
)

PROBLEM = make_problem(n=2)
NUMBER = Member(Cause(PARAMETRIC, (), (Number(CHANGE, "1"),), lambda scene: [], variant=MASS),
                (0, 1), {CHANGE: np.zeros(2)}, {CHANGE: np.ones(2)})
RUBS, HANGS, PULLS, WEAK = (make_member(cause, PROBLEM) for cause in (
    friction.COULOMB, load.GRAVITY, load.SPRING, drive.TORQUE_GAIN_ERROR))


def swapped(*members):
    return list(with_swapped_number(members, [NUMBER]))


def test_one_number_takes_the_place_of_all_effects_like_it():
    assert swapped(RUBS, HANGS, PULLS) == [(RUBS, NUMBER)]
    assert swapped(WEAK, RUBS) == [(RUBS, NUMBER)]


def test_a_number_takes_the_place_of_no_other_effect():
    assert swapped(RUBS) == [] and swapped(RUBS, RUBS) == []


def test_a_number_alone_is_fitted_anyway():
    assert swapped(HANGS) == [] and swapped(HANGS, PULLS) == []


def test_coupled_links_with_a_wrong_number_take_the_place_of_a_payload():
    uncoupled = make_problem(n=2, known_links=True)
    held = make_member(load.PAYLOAD, uncoupled, mass=0.1)
    found = list(with_coupled_number((RUBS, held), uncoupled))
    assert {some[-1].cause.variant for some in found} == {MASS, COM, INERTIA, LENGTH}
    assert all(some[0] is RUBS and some[1].cause is load.COUPLING and len(some) == 3
               for some in found)
    assert not list(with_coupled_number((RUBS,), uncoupled))
    assert not list(with_coupled_number((held,), make_problem(n=2)))  # no links are stated


def test_a_problem_without_a_robot_file_has_no_number_to_be_wrong():
    assert wrong_numbers(PROBLEM) == []
