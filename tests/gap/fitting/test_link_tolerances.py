"""Links that are known within a tolerance: what a fit may move, and what moves with it."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.description import corrected_links
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.robot_loop.links import planar_links
from tests.gap.factories import make_problem

MASS, COM = [1.0, 0.5], [0.2, 0.1]


def hypothesis(mass_tolerance=0.0, com_tolerance=0.0):
    problem = make_problem(n=2)
    return build_hypothesis(dataclasses.replace(
        problem, links=planar_links([0.4, 0.3], MASS, COM, [0.01, 0.005], has_gravity=True),
        nominal=dataclasses.replace(problem.nominal, mass_tolerance=mass_tolerance,
                                    com_tolerance=com_tolerance)), ())


def of_links(one):
    return [parameter for parameter in one.free_parameters if parameter.key.startswith("links.")]


def test_links_without_a_tolerance_stay_as_stated():
    assert of_links(hypothesis()) == []


def test_a_heavier_link_has_a_larger_inertia_in_the_same_ratio():
    one = hypothesis(mass_tolerance=0.05)
    first, second = of_links(one)
    assert (first.key, first.joint, first.centre, first.tolerance) == (
        "links.mass", 0, 1.0, pytest.approx(0.05))
    moved = one.moved([(second, 0.6)])
    assert moved["links.mass"] == pytest.approx([1.0, 0.6])
    assert moved["links.inertia"][0] == pytest.approx(one.values["links.inertia"][0])
    assert moved["links.inertia"][1] == pytest.approx(1.2 * one.values["links.inertia"][1])
    back = one.with_values(moved).moved([(second, 0.5)])
    assert back["links.inertia"] == pytest.approx(one.values["links.inertia"])


def test_centres_of_mass_move_where_they_are_not_zero():
    one = hypothesis(com_tolerance=0.01)
    free = of_links(one)
    assert [(parameter.joint, parameter.axis, parameter.centre) for parameter in free] == [
        (0, 0, 0.2), (1, 0, 0.1)]
    assert [one.get(parameter) for parameter in free] == COM
    moved = one.with_values(one.moved([(free[1], 0.13)]))
    assert moved.get(free[1]) == 0.13 and moved.get(free[0]) == 0.2
    assert np.count_nonzero(moved.values["links.com"]) == 2
    assert moved.prior_violations(0.25)[-1] == pytest.approx((3.0 - 1.0) / 0.25)


def test_the_links_of_a_fitted_model_have_its_masses():
    one = hypothesis(mass_tolerance=0.05)
    first, _ = of_links(one)
    links = corrected_links(one.problem.links, one.moved([(first, 1.04)]))
    assert links.mass == pytest.approx([1.04, 0.5])
    assert links.inertia[0] == pytest.approx(1.04 * one.problem.links.inertia[0])
    assert corrected_links(one.problem.links, {}).mass == pytest.approx(MASS)
