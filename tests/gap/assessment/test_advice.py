"""What the robot file should state first: the links, where a torque follows the pose."""

import dataclasses

from factories import make_fit, make_member, make_problem, make_ranked

from clie_blocks.analysis.gap.assessment.advice import advice
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.load import SPRING
from clie_blocks.analysis.records import Robot


def advised(cause, known_links=False):
    problem = dataclasses.replace(make_problem(known_links=known_links), robot=Robot(n=1))
    fit = make_fit(problem, make_member(cause, problem))
    return advice(problem, [make_ranked(cause.name, 0.95, 0.1, fit)])


def test_links_are_asked_for_first_where_a_torque_follows_the_pose():
    (sentence,) = advised(SPRING)
    assert "[links] length_m, mass_kg, com_m, inertia_kgm2" in sentence


def test_links_that_are_stated_or_do_not_matter_are_not_asked_for():
    assert advised(SPRING, known_links=True) == () == advised(COULOMB)


def test_the_closest_effect_counts_where_nothing_explains_the_gap():
    problem = dataclasses.replace(make_problem(), robot=Robot(n=1))
    fit = make_fit(problem, make_member(SPRING, problem))
    ranking = [make_ranked("unknown", 0.99), make_ranked("spring", 0.01, 5.0, fit)]
    assert len(advice(problem, ranking)) == 1
