"""One log only: what is judged was left out of the fit."""

import numpy as np
import pytest
from factories import Missing, make_fit, make_problem, make_residual_model

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.gap_reduction import (
    bear_out_beyond_noise,
    blocks,
    folds,
    gap_reduction,
    unseen_errors,
)
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.prediction_error import square_errors
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer


@pytest.fixture(scope="module")
def alone():
    made = draw_cases(1, 6, ["coulomb"], ["single"], duration=12.0)[0]
    asked = Problem.from_logs(made.robot, made.records[:1])
    return made, *fit_nominal(asked, METHOD)


def test_blocks_are_long_and_cover_the_log():
    edges = blocks(12_000, 1e-3, METHOD.assessment)
    assert edges[0] == 0 and edges[-1] == 12_000
    assert np.diff(edges).min() >= 2000
    assert len(blocks(7_000, 1e-3, METHOD.assessment)) == 0


def test_each_sample_is_left_out_once_whatever_the_lengths_of_the_logs():
    for lengths in ([8_000, 20_000, 13_000], [6_000, 20_000], [5_000, 6_000, 7_000]):
        times = [np.zeros(length, int) for length in lengths]
        for fold in folds(lengths, 1e-3, METHOD.assessment):
            for left_out, count in zip(fold, times):
                for first, last in left_out:
                    count[first:last] += 1
        assert all(np.all(count == 1) for count in times)
    assert folds([7_000], 1e-3, METHOD.assessment) == []


FLOOR = 1e-4  # rad


def judged(before, after, held_out=1):
    """Reduction of errors of a random size, by blocks of unequal size, in units of the noise."""
    rng = np.random.default_rng(1)
    problem = make_problem([np.zeros((4000, 1))] * 2, held_out=held_out)
    sizes = np.repeat(rng.uniform(0.5, 1.5, 20), 200)[:, None]

    def missing(size):
        missed = FLOOR * sizes * size * rng.choice([-1.0, 1.0], (4000, 1))
        return Missing(problem, (), build_hypothesis(problem, ()).values, missed)

    return gap_reduction(missing(before), missing(after), make_residual_model(problem, FLOOR))


def test_a_model_that_predicts_unseen_logs_better_earns_its_name():
    better, alike, worse, slight = (judged(20.0, after) for after in (4.0, 20.0, 30.0, 19.0))
    assert better.earned == 1.0 and better.unseen
    assert alike.earned == worse.earned == 0.0
    assert slight.percent > 0.0 and slight.earned == 0.0  # nine tenths are something else


def test_a_model_that_alone_leaves_only_noise_earns_its_name():
    assert judged(20.0, 0.9).only_noise and judged(20.0, 0.9).earned == 1.0
    assert not judged(20.0, 4.0).only_noise
    assert not judged(0.9, 0.8).only_noise  # so does the nominal model
    assert not judged(20.0, 0.9, held_out=0).only_noise


@pytest.mark.parametrize(("before", "after", "held_out", "earned"), [
    (4.0, 0.1, 1, True), (4.0, 3.9, 1, False), (0.1, -0.2, 1, False), (4.0, 0.1, 0, False)])
def test_held_out_logs_bear_out_what_their_whitened_errors_show(before, after, held_out, earned):
    """The gap also holds noise that rings: a payload of 1.6 g was not borne out beside it."""
    problem = make_problem(held_out=held_out)
    nominal, corrected = (make_fit(problem, excess=excess) for excess in (before, after))
    assert bear_out_beyond_noise(nominal, corrected, METHOD) == earned


def test_where_nothing_can_be_removed_nothing_need_be_earned():
    assert judged(1.0, 1.0).percent is None
    assert judged(1.0, 1.0).earned == 1.0


@pytest.mark.slow
def test_a_short_log_is_judged_by_a_model_that_saw_the_other_one_only(case):
    made = case("coulomb")
    residuals, nominal = fit_nominal(
        Problem.from_logs(made.robot, made.records[:2], held_out=[]), METHOD)
    unseen = unseen_errors(nominal.hypothesis, residuals, [1])
    assert len(unseen) == 1 and len(unseen[0]) == len(nominal.hypothesis.problem.fit[1])
    _, other = fit_nominal(Problem.from_logs(made.robot, made.records[:2], held_out=[1]), METHOD)
    alone = np.mean(square_errors(other.hypothesis, 1))
    assert np.mean(square_errors(nominal.hypothesis, 1)) < np.mean(unseen[0])
    assert np.mean(unseen[0]) == pytest.approx(alone, rel=0.05)


@pytest.mark.slow
def test_a_block_is_judged_by_a_model_that_did_not_see_it(alone):
    _, residuals, nominal = alone
    (unseen,) = unseen_errors(nominal.hypothesis, residuals, [0])
    seen = square_errors(nominal.hypothesis, 0)
    assert np.all(np.isfinite(unseen)) and len(unseen) == len(seen)
    assert np.mean(unseen) > np.mean(seen)  # the fit saw all of it


@pytest.mark.slow
def test_a_single_log_is_judged_by_blocks_and_the_answer_says_so(alone):
    made, *_ = alone
    found = diagnose(Problem.from_logs(made.robot, made.records[:1]))
    told = answer(found)["closed_percent"]
    assert told["judged_on"] == "blocks left out of the fit" and told["unseen_data"]
    low, high = told["interval"]
    assert 90.0 < low <= told["value"] <= high <= 100.5
    assert found.reduction.after < 1.1 * found.reduction.floor
