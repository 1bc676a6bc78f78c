"""The softened loop: the same commands, the same residual of a linear model, backlash found."""

import dataclasses

import numpy as np
import pytest
from factories import make_fit, make_member, make_ranked, make_row, make_table

from clie_blocks.analysis.gap.backlash import (
    explain_backlash,
    multistart,
    soften_loop,
    to_stated_loop,
)
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.explain import Explanation
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.method import METHOD

UNTRAINED = dataclasses.replace(METHOD, calibration=Calibration())


@pytest.fixture(scope="module")
def backlash_fit(healthy):
    """Function that returns a fit of backlash alone that leaves some excess."""
    member = make_member(BACKLASH, healthy)
    return lambda excess: make_fit(healthy, member, excess=excess)


@pytest.fixture
def evidence(backlash_fit):
    """Function from the excess of some hypotheses to their evidence; `nominal` has no cause."""
    def table(nominal, **excesses):
        rows = [make_row(name, excess, 2.0, fit=backlash_fit(excess) if name == "backlash" else
                         None) for name, excess in excesses.items()]
        return make_table(nominal, *rows)

    return table


class PreparedExplain:
    """In the place of `explain`: records its calls and returns prepared evidence."""

    def __init__(self, alone=None, whole=None):
        self.tables, self.calls = [alone, whole], []

    def __call__(self, problem, causes, method, steps, test_lack_of_fit=True, deadline=np.inf):
        assert test_lack_of_fit == bool(self.calls)
        self.calls.append((problem, causes, method))
        return Explanation(*fit_nominal(problem, method), self.tables[len(self.calls) - 1])


def second_explanation(problem, first, explain, restarted=None):
    """Explanation in the softened loop after some first evidence."""
    residuals, nominal = fit_nominal(problem, UNTRAINED)
    residuals = dataclasses.replace(residuals, problem=problem)
    return explain_backlash(Explanation(residuals, nominal, first), CAUSES, UNTRAINED,
                            explain=explain, restart=lambda start, residuals: restarted)


def test_a_model_that_moves_as_the_robot_gets_the_recorded_command(healthy):
    softened = soften_loop(healthy, METHOD)
    for log, recorded in zip(softened.logs, healthy.logs):
        assert np.allclose(softened.law.replay(log.q, log.q_d, log.pe), recorded.u, atol=1e-12)
    assert np.all(softened.law.kp < healthy.law.kp) and np.all(softened.law.kd < healthy.law.kd)


def test_the_residual_of_a_healthy_robot_is_noise_in_both_loops(healthy):
    for problem in (healthy, soften_loop(healthy, METHOD)):
        assert abs(fit_nominal(problem, METHOD)[1].excess) < 0.15


def test_backlash_that_the_first_explanation_misses_is_found(healthy, evidence, backlash_fit):
    explain = PreparedExplain(evidence(200.0, backlash=3.0),
                              evidence(200.0, backlash=3.0, joint_elasticity=120.0))
    second = second_explanation(healthy, evidence(150.0, joint_elasticity=80.0), explain,
                                backlash_fit(2.0))
    excess = {row.names: row.excess for row in second.evidence.rows}
    assert excess == pytest.approx({("backlash",): 2.0, ("joint_elasticity",): 120.0})
    assert [causes for _, causes, _ in explain.calls] == [(BACKLASH,), CAUSES]
    assert all(problem.quiet for problem, _, _ in explain.calls)


@pytest.mark.parametrize("nominal, first", [
    (50.0, {"coulomb": 0.1}), (1e5, {"coulomb": 5.0}), (0.2, {}), (90.0, {"backlash": 1.0})],
    ids=["explained", "a large gap explained", "no gap", "backlash already"])
def test_a_first_explanation_that_suffices_stands(healthy, evidence, nominal, first):
    explain = PreparedExplain()
    assert second_explanation(healthy, evidence(nominal, **first), explain) is None
    assert not explain.calls


def test_the_library_is_not_searched_where_backlash_explains_next_to_nothing(healthy, evidence):
    explain = PreparedExplain(evidence(200.0, backlash=190.0))
    assert second_explanation(healthy, evidence(150.0, coulomb=80.0), explain) is None
    assert len(explain.calls) == 1


def test_a_second_explanation_without_backlash_does_not_count(healthy, evidence, backlash_fit):
    """Recorded commands hide a fault of the controller, and no gap seems to be left."""
    explain = PreparedExplain(evidence(2.0, backlash=0.3), evidence(2.0, coulomb=0.01))
    assert second_explanation(healthy, evidence(150.0, coulomb=80.0), explain,
                              backlash_fit(1.5)) is None
    assert len(explain.calls) == 2


def test_the_library_is_not_searched_where_the_first_explanation_is_better(healthy, evidence):
    explain = PreparedExplain(evidence(200.0, backlash=60.0))
    assert second_explanation(healthy, evidence(150.0, coulomb=2.0), explain) is None
    assert len(explain.calls) == 1


def test_a_simulator_or_a_law_without_damping_gets_no_second_explanation(healthy, evidence):
    first, explain = evidence(150.0, coulomb=80.0), PreparedExplain()
    undamped = dataclasses.replace(healthy, law=dataclasses.replace(healthy.law,
                                                                    kd=0.0 * healthy.law.kd))
    for problem in (dataclasses.replace(healthy, quiet=True), undamped):
        assert second_explanation(problem, first, explain) is None
    assert not explain.calls


def test_a_model_of_the_softened_loop_predicts_in_the_stated_loop(healthy):
    residuals, nominal = fit_nominal(healthy, METHOD)
    _, softened = fit_nominal(soften_loop(healthy, METHOD), METHOD)
    ranking, model = to_stated_loop(
        [make_ranked("none", 1.0, fit=softened), make_ranked("unknown", 0.0)], softened,
        residuals.problem)
    assert ranking[1].fit is None
    stated_error = nominal.hypothesis.error(0)
    for moved in (ranking[0].fit, model):
        difference = moved.hypothesis.error(0) - stated_error
        assert np.abs(difference).max() < 0.5 * np.abs(stated_error).max()
        assert np.array_equal(moved.hypothesis.values["kp"], healthy.law.kp)


def test_backlash_is_found_from_a_start_that_is_off(healthy):
    """The robot is the model itself with 2 mrad of backlash; the fit starts from half of it."""
    problem = dataclasses.replace(healthy, fit=healthy.fit[:1], held_out=())
    joints, one = tuple(range(problem.n)), np.ones(problem.n)

    def loose(half_gap):
        values = {"half_gap": half_gap * one, "link_share": 0.5 * one, "loose": one,
                  "bearing_share": 0.0 * one, "contact": 500.0 * one}
        return Member(BACKLASH, joints, values, {**values, "half_gap": 1e-3 * one,
                                                 "bearing_share": 0.5 * one})

    residuals, nominal = fit_nominal(problem, METHOD)
    robot = build_hypothesis(residuals.problem, [loose(2e-3)], nominal.hypothesis)
    log, = residuals.problem.fit
    of_robot = dataclasses.replace(log, q=log.q - robot.error(0) + log.dither)
    problem = dataclasses.replace(residuals.problem, fit=(of_robot,))
    residuals = dataclasses.replace(residuals, problem=problem)
    start = fit(build_hypothesis(problem, [loose(1e-3)], nominal.hypothesis), residuals, 0)
    best = multistart(start, residuals)
    assert best.total < 0.1 * start.total
    assert np.allclose(best.hypothesis.values["backlash.half_gap"], 2e-3, rtol=0.2)
