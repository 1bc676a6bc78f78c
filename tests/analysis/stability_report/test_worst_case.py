"""Worst cases over a box: monotonicity by algebra, vertices against random points inside."""

import numpy as np
import pytest
import sympy as sp

from clie_blocks import paper
from clie_blocks.analysis.stability_report.worst_case import (
    ParameterBox,
    worst_case,
    worst_disturbance_norm,
    worst_gain,
)
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    condition,
    disturbance_norm,
    theorem_2,
    ultimate_bound,
)
from clie_blocks.excitation import paper_excitation
from clie_blocks.signals import DiagramError

BOX = ParameterBox.around(paper.THETA, [0.3, 0.1, 0.2, 0.1, 0, 0], [0, 0, 0, 0, 0.05, 0.02])
SYMBOLS = sp.symbols("a b kp kd", positive=True)


def signs(expression):
    """Signs of the derivatives by a, b, kp, kd for positive values."""
    return [sp.simplify(sp.diff(expression, s)) for s in SYMBOLS]


def test_k_bar_is_monotone_in_everything_by_algebra():
    a, b, kp, kd = SYMBOLS
    by_a, by_b, by_kp, by_kd = signs(kd / kp * (a + b * kd) - 1)
    assert by_a.is_positive and by_b.is_positive and by_kd.is_positive and by_kp.is_negative


def test_both_terms_of_k_1_rise_with_a_and_b():
    a, b, kp, kd = SYMBOLS
    for term in (kd * b * kp, kd * (kd / kp * (a + b * kd) - 1)):
        by_a, by_b, *_ = signs(term)
        assert by_a.is_nonnegative and by_b.is_positive


def test_the_factors_of_mu_0_are_monotone_by_algebra():
    a, b, kp, kd = SYMBOLS
    w = a + b * kd
    rising, falling = sp.sqrt(1 + w**2 / 4), [2 / w, 2 / (w * b * kp)]
    assert all(sp.factor(d).is_positive for d in signs(rising)[:2])
    for factor in falling:
        assert all(sp.factor(d).is_nonpositive for d in signs(factor)[:2])
        assert all(sp.factor(sp.together(d)).is_nonpositive
                   for d in signs((rising * factor) ** 2)[:2])


def test_no_point_of_the_box_is_worse_than_the_vertices():
    rng, worst = np.random.default_rng(0), worst_case(
        BOX, paper.KP, paper.KD, paper_excitation, alpha=1e-3, eps_bar=1e-3)
    gain = worst_gain(BOX, paper.KP, paper.KD)
    for theta in rng.uniform(BOX.lower, BOX.upper, size=(200, 6)):
        joints = ControlledJoints.from_theta(theta, paper.KP, paper.KD)
        assert np.all(condition(joints).per_joint >= worst.condition.per_joint)
        assert np.all(condition(joints).smallest_kd <= worst.condition.smallest_kd)
        assert theorem_2(joints, 1e-3).mu_1 <= worst.theorem_2.mu_1
        assert ultimate_bound(joints, 1.0).mu_0 <= gain * (1 + 1e-12)
        eta, _ = disturbance_norm(joints, paper_excitation, step=0.01)
        assert eta <= worst.eta_norm * (1 + 1e-12)
        assert ultimate_bound(joints, eta).mu_0 <= worst.mu_0[1]


def test_the_worst_values_are_reached():
    vertices = [ControlledJoints.from_theta(v, paper.KP, paper.KD) for v in BOX.vertices()]
    assert len(vertices) == 64
    assert max(ultimate_bound(j, 1.0).mu_0 for j in vertices) == pytest.approx(
        worst_gain(BOX, paper.KP, paper.KD), rel=1e-12)
    reached = max(disturbance_norm(j, paper_excitation, step=0.01)[0] for j in vertices)
    assert reached == pytest.approx(
        worst_disturbance_norm(BOX, paper.KP, paper.KD, paper_excitation, step=0.01), rel=1e-12)


def test_a_box_of_one_point_is_the_point():
    box = ParameterBox.around(paper.THETA, 0.0)
    worst = worst_case(box, paper.KP, paper.KD, paper_excitation, alpha=1e-3, eps_bar=2.36e-5)
    assert worst.mu_0[0] == pytest.approx(worst.mu_0[1], rel=2e-4)  # grids of 10 and 0.1 ms
    assert worst.mu_0[1] == pytest.approx(0.96385, abs=1e-5)
    assert worst.theorem_2.k_1 == pytest.approx(6.189)


def test_an_empty_box_is_refused():
    with pytest.raises(DiagramError, match="lower <= upper"):
        ParameterBox(np.ones(3), np.zeros(3))


def test_a_box_of_two_joints_has_its_vertices_where_one_joint_differs():
    uniform = {tuple(vertex) for vertex in BOX.uniform_vertices()}
    assert uniform == {tuple(vertex) for vertex in BOX.vertices()}


def test_six_joints_have_a_bracket_that_random_points_keep_to():
    rng = np.random.default_rng(1)
    box = ParameterBox.around(rng.uniform(0.5, 2.0, 18), 0.2)
    worst = worst_case(box, np.ones(6), 3 * np.ones(6), paper_excitation, alpha=1e-3, eps_bar=0.1)
    assert worst.mu_0[0] <= worst.mu_0[1]
    for theta in rng.uniform(box.lower, box.upper, size=(50, 18)):
        joints = ControlledJoints.from_theta(theta, np.ones(6), 3 * np.ones(6))
        eta, _ = disturbance_norm(joints, paper_excitation, step=0.01)
        assert ultimate_bound(joints, eta).mu_0 <= worst.mu_0[1]
