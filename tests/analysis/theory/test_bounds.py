"""Conditions and bounds against the paper's printed numbers and a second route to each."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks import paper
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    condition,
    disturbance_norm,
    theorem_2,
    theorem_4,
    ultimate_bound,
)
from clie_blocks.excitation import paper_excitation
from clie_blocks.signals import DiagramError

PAPER = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
positive = st.floats(0.01, 100.0)


@pytest.mark.parametrize("gains", paper.GAIN_PAIRS)
def test_mu_0_is_as_printed_at_the_three_gain_pairs(gains):
    joints = ControlledJoints.from_theta(paper.THETA, *gains)
    mu_0 = ultimate_bound(joints, paper.ETA_NORM).mu_0
    assert mu_0 == pytest.approx(paper.MU_0[gains], abs=5e-5)


def test_ingredients_of_mu_0():
    bound = ultimate_bound(PAPER, paper.ETA_NORM)
    assert bound.lambda_min_a == pytest.approx(2.2378)
    assert bound.norm_b == pytest.approx(2.45956, abs=1e-5)
    assert bound.invariant.blow_up == pytest.approx(4.873, abs=1e-3)
    assert bound.invariant.outer == pytest.approx(4.70, abs=5e-3)


def test_disturbance_norm_is_the_printed_one_and_a_maximum_not_an_rms():
    norm, instant = disturbance_norm(PAPER, paper_excitation)
    assert norm == pytest.approx(0.876945, abs=1e-5)
    assert instant == pytest.approx(1.7331, abs=1e-3)
    assert abs(norm - paper.ETA_NORM) < 2e-4


@given(a=positive, b=positive, kp=positive, kd=positive)
@settings(max_examples=60, deadline=None)
def test_edge_gains_make_the_condition_zero(a, b, kp, kd):
    edge = condition(ControlledJoints([a], [b], [0.0], [kp], [kd]))
    at_kd = ControlledJoints([a], [b], [0.0], [kp], edge.smallest_kd)
    at_kp = ControlledJoints([a], [b], [0.0], edge.largest_kp, [kd])
    assert at_kd.k_bar[0] == pytest.approx(0, abs=1e-9)
    assert at_kp.k_bar[0] == pytest.approx(0, abs=1e-9)
    assert (kd > edge.smallest_kd[0]) == edge.holds or edge.margin == pytest.approx(0, abs=1e-9)


def test_condition_names_the_margin_per_joint():
    result = condition(PAPER)
    np.testing.assert_allclose(result.per_joint, [1.2378, 1.2471], atol=1e-6)
    assert result.holds and result.margin == pytest.approx(1.2378)
    assert not condition(ControlledJoints.from_theta(paper.THETA, 10.0, 2.0)).holds


def test_constants_of_theorem_2():
    result = theorem_2(PAPER, paper.EPS_NORM[1])
    assert result.k_1 == pytest.approx(paper.K_1, abs=1e-6)
    assert result.k_1_printed == pytest.approx(paper.K_1_PRINTED, abs=5e-3)
    assert result.k_2 == paper.K_2
    assert result.threshold == pytest.approx(1.6688e-4, abs=1e-8)
    assert result.mu_1 == pytest.approx(2.70e-5, abs=5e-8)
    assert result.mu_1_printed == pytest.approx(1.49e-5, abs=5e-8)
    assert result.rho == pytest.approx(6.189 - 1.6688e-4, abs=1e-6)


@pytest.mark.parametrize("case, threshold, mu_2, by_text, holds", [
    (2, 1.9919e-4, 1.99, 3.71e-3, False), (3, 7.6730e-4, 0.767, 7.28e-3, True)])
def test_constants_of_theorem_4(case, threshold, mu_2, by_text, holds):
    result = theorem_4(PAPER, paper.ALPHA[case], paper.EPS_NORM[case])
    assert result.threshold == pytest.approx(threshold, abs=1e-8)
    assert result.k_3 == paper.K_3[case]
    assert result.k_3_printed == pytest.approx(paper.K_3_PRINTED, abs=5e-3)
    assert result.mu_2 == pytest.approx(mu_2, rel=3e-3)
    assert result.mu_2_printed == pytest.approx(by_text, rel=2e-3)
    assert result.holds is holds and (result.varrho > 0) is holds


def test_bounds_are_infinite_where_the_condition_fails():
    joints = ControlledJoints.from_theta(paper.THETA, 10.0, 2.0)
    assert theorem_2(joints, 1e-3).mu_1 == theorem_4(joints, 1e-3, 1e-3).mu_2 == np.inf


def test_one_joint_and_seven_joints_are_the_same_formulas():
    many = ControlledJoints(*(np.full(7, value) for value in (2.0, 0.5, 0.1, 10.0, 5.0)))
    one = ControlledJoints([2.0], [0.5], [0.1], [10.0], [5.0])
    assert ultimate_bound(many, 1.0).mu_0 == pytest.approx(ultimate_bound(one, 1.0).mu_0)
    assert theorem_2(many, 0.1) == theorem_2(one, 0.1)


@pytest.mark.parametrize("changes, message", [
    ({"kp": [-1.0]}, "kp must be greater than 0"), ({"b": [0.0]}, "b must be greater than 0"),
    ({"kd": [1.0, 2.0]}, "kd needs 1 numbers"), ({"a": [np.nan]}, "a must be finite")])
def test_wrong_joints_are_refused_by_name(changes, message):
    good = {"a": [2.0], "b": [0.5], "d": [0.0], "kp": [10.0], "kd": [5.0]}
    with pytest.raises(DiagramError, match=message):
        ControlledJoints(**{**good, **changes})
