"""Names that the logs do not tell apart: hypotheses whose models move the robot alike."""

import dataclasses

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem, make_ranked, make_residual_model

from clie_blocks.analysis.gap.causes import drive, friction, load
from clie_blocks.analysis.gap.verdict.alike import motion_distance, names_alike
from clie_blocks.analysis.gap.verdict.posterior import verdict

PERIOD = 0.01  # s
TIME = PERIOD * np.arange(1500)
SWAY = [np.stack([np.sin(TIME + j), np.cos(2.3 * TIME + j)], axis=1) for j in range(3)]


@pytest.fixture(scope="module")
def problem():
    return make_problem(SWAY, period=PERIOD)


def dry(problem, **levels):
    return make_fit(problem, make_member(friction.ASYMMETRIC_COULOMB, problem, **levels))


@pytest.fixture(scope="module")
def coulomb(problem):
    return make_fit(problem, make_member(friction.COULOMB, problem, level=0.3))


def alike(problem, *ranked):
    return names_alike(ranked, make_residual_model(problem))


def test_friction_of_one_level_is_not_told_from_that_of_two_equal_ones(problem, coulomb):
    even = make_ranked("asymmetric_coulomb", 0.3, fit=dry(problem, forward=0.3, backward=0.3))
    uneven = make_ranked("asymmetric_coulomb", 0.3, fit=dry(problem, forward=0.3, backward=0.25))
    leading = make_ranked("coulomb", 0.7, fit=coulomb)
    assert alike(problem, leading, even) == (("coulomb", "asymmetric_coulomb"),)
    assert alike(problem, leading, uneven) == ()


def test_a_rival_that_is_hardly_likely_stands_for_nothing(problem, coulomb):
    even = make_ranked("asymmetric_coulomb", 0.05, fit=dry(problem, forward=0.3, backward=0.3))
    assert alike(problem, make_ranked("coulomb", 0.95, fit=coulomb), even) == ()


def test_a_third_name_that_is_alike_takes_no_place_from_the_others(problem, coulomb):
    def ranked(name, probability):
        fit = make_fit(problem, make_member(friction.ASYMMETRIC_COULOMB, problem, forward=0.3,
                                            backward=0.3))
        return make_ranked(name, probability, fit=fit)

    leading = make_ranked("coulomb", 0.63, fit=coulomb)
    assert alike(problem, leading, ranked("stribeck", 0.28), ranked("presliding", 0.09)) == (
        ("coulomb", "stribeck", "presliding"),)


def test_the_distance_is_a_squared_error_in_units_of_the_noise(problem, coulomb):
    uneven = dry(problem, forward=0.3, backward=0.25)
    far, near = (motion_distance(coulomb, uneven, make_residual_model(problem, sigma))
                 for sigma in (1e-5, 1e-4))
    assert far == pytest.approx(100.0 * near) and near > 0.0
    assert motion_distance(uneven, coulomb, make_residual_model(problem)) == pytest.approx(near)
    assert motion_distance(coulomb, coulomb, make_residual_model(problem)) == 0.0


def test_beside_a_sure_cause_only_the_one_in_doubt_has_names_that_stand_for_it(problem):
    both = make_fit(problem, make_member(friction.COULOMB, problem, level=0.3),
                    make_member(load.SPRING, problem, stiffness=0.1))
    other = make_fit(problem, make_member(load.SPRING, problem, stiffness=0.1), make_member(
        friction.ASYMMETRIC_COULOMB, problem, forward=0.3, backward=0.3))
    assert alike(problem, make_ranked("coulomb+spring", 0.6, fit=both),
                 make_ranked("asymmetric_coulomb+spring", 0.4, fit=other)) == (
                     ("coulomb", "asymmetric_coulomb"),)


CAUSES = (friction.COULOMB, friction.ASYMMETRIC_COULOMB, drive.ACTUATOR_LAG, drive.TIME_DELAY)


def test_friction_of_one_level_stands_for_that_of_two_which_was_not_fitted(problem, coulomb):
    leading = make_ranked("coulomb", 0.9, fit=coulomb, excess=0.4)
    residuals = make_residual_model(problem)
    expected = (("coulomb", "asymmetric_coulomb"),)
    assert names_alike((leading,), residuals, CAUSES) == expected
    assert names_alike((leading,), residuals, (friction.COULOMB,)) == ()  # not to be named
    uneven = dry(problem, forward=0.3, backward=0.25)
    for left, names in ((7.0, expected), (0.1, ())):  # a false minimum, a better fit
        other = make_ranked("asymmetric_coulomb", 0.01, fit=uneven, excess=left)
        assert names_alike((leading, other), residuals, CAUSES) == names


def test_a_rival_that_is_alike_for_two_reasons_is_named_once(problem, coulomb):
    leading = make_ranked("coulomb", 0.7, fit=coulomb, excess=0.4)
    even = make_ranked("asymmetric_coulomb", 0.3, excess=7.0,
                       fit=dry(problem, forward=0.3, backward=0.3))
    assert names_alike((leading, even), make_residual_model(problem), CAUSES) == (
        ("coulomb", "asymmetric_coulomb"),)


@pytest.mark.parametrize("lag, names", [(1e-3, (("actuator_lag", "time_delay"),)), (0.1, ())])
def test_a_short_lag_beside_others_stands_for_a_delay_that_was_not_fitted(problem, lag, names):
    def with_lag(problem):
        return make_fit(problem, make_member(load.SPRING, problem, stiffness=0.1),
                        make_member(drive.ACTUATOR_LAG, problem, lag=lag))

    elsewhere = with_lag(problem).hypothesis
    logged = problem.with_log_list([dataclasses.replace(log, q=log.q - elsewhere.error(j))
                                    for j, log in enumerate(problem.logs)])
    leading = make_ranked("actuator_lag+spring", 0.9, fit=with_lag(logged))
    assert names_alike((leading,), make_residual_model(logged), CAUSES) == names


def test_names_that_are_alike_lead_together():
    split = [make_ranked("spring", 0.45), make_ranked("gravity", 0.44), make_ranked("none", 0.11)]
    assert verdict(split) == "not_identifiable"
    assert verdict(split, alike=[("spring", "gravity")]) == "effect"


def test_an_effect_that_is_alike_with_a_wrong_number_is_not_identified():
    ranking = [make_ranked("torque_gain_error", 0.7), make_ranked("parametric", 0.3)]
    assert verdict(ranking) == "effect"
    assert verdict(ranking, alike=[("torque_gain_error", "parametric")]) == "not_identifiable"
    beside = [make_ranked("payload+step_fault", 0.7), make_ranked("parametric+step_fault", 0.3)]
    assert verdict(beside, alike=[("payload", "parametric")]) == "effect"
