"""One log only: what is judged was left out of the fit."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.gap_reduction import blocks, folds, unseen_errors
from clie_blocks.analysis.gap.assessment.ultimate_bound import modelling_error, ultimate_bound
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.prediction_error import square_errors
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem, problem
from clie_blocks.analysis.gap.report.answer import answer


@pytest.fixture(scope="module")
def alone():
    made = draw_cases(1, 6, ["coulomb"], ["single"], duration=12.0)[0]
    asked = problem(made.robot, made.records[:1])
    return made, *fit_nominal(asked, METHOD)


def test_blocks_are_long_and_cover_the_log():
    edges = blocks(12_000, 1e-3)
    assert edges[0] == 0 and edges[-1] == 12_000
    assert np.diff(edges).min() >= 2000
    assert len(blocks(7_000, 1e-3)) == 0


def test_each_sample_is_left_out_once_whatever_the_lengths_of_the_logs():
    for lengths in ([8_000, 20_000, 13_000], [6_000, 20_000], [5_000, 6_000, 7_000]):
        times = [np.zeros(length, int) for length in lengths]
        for fold in folds(lengths, 1e-3):
            for left_out, count in zip(fold, times):
                for first, last in left_out:
                    count[first:last] += 1
        assert all(np.all(count == 1) for count in times)
    assert folds([7_000], 1e-3) == []


def test_a_short_log_is_judged_by_a_model_that_saw_the_other_one_only(case):
    made = case("coulomb")
    bench, base = fit_nominal(problem(made.robot, made.records[:2], held_out=[]), METHOD)
    unseen = unseen_errors(base.hypothesis, bench, [1])
    assert len(unseen) == 1 and len(unseen[0]) == len(base.hypothesis.problem.fit[1])
    _, other = fit_nominal(problem(made.robot, made.records[:2], held_out=[1]), METHOD)
    alone = np.mean(square_errors(other.hypothesis, 1))
    assert np.mean(square_errors(base.hypothesis, 1)) < np.mean(unseen[0])
    assert np.mean(unseen[0]) == pytest.approx(alone, rel=0.05)


def test_a_block_is_judged_by_a_model_that_did_not_see_it(alone):
    _, bench, base = alone
    (unseen,) = unseen_errors(base.hypothesis, bench, [0])
    seen = square_errors(base.hypothesis, 0)
    assert np.all(np.isfinite(unseen)) and len(unseen) == len(seen)
    assert np.mean(unseen) > np.mean(seen)  # the fit saw all of it


def test_a_single_log_is_judged_by_blocks_and_the_answer_says_so(alone):
    made, *_ = alone
    found = diagnose(Problem.from_logs(made.robot, made.records[:1]))
    told = answer(found)["closed_percent"]
    assert told["judged_on"] == "blocks left out of the fit" and told["unseen_data"]
    low, high = told["interval"]
    assert 90.0 < low <= told["value"] <= high <= 100.5
    assert found.reduction.after < 1.1 * found.reduction.floor


def test_the_modelling_error_is_what_made_the_prediction_error(alone):
    _, _, base = alone
    at = base.hypothesis
    time = at.problem.period * np.arange(12_000)
    torque = 0.02 * np.sin(2 * np.pi * 0.5 * time) * np.sin(np.pi * time / 12.0) ** 4
    values = at.values["inertia"][0], at.values["damping"][0]
    moved = lfilter(*at.problem.law.torque_sensitivity(0, *values), torque)[:, None]
    missed = SimpleNamespace(problem=at.problem, values=at.values,
                             error=lambda j, dithered: moved)
    found = modelling_error(missed, 0)[:, 0] * values[0]
    assert found == pytest.approx(torque, abs=2e-4)


def test_theorem_2_gives_a_smaller_radius_to_a_better_model(alone):
    made, bench, base = alone
    level = ultimate_bound(base.hypothesis)
    after = ultimate_bound(diagnose(Problem.from_logs(made.robot, made.records[:1])).model.hypothesis)
    assert after[0] < 0.4 * level[0] and after[1] < 0.4 * level[1]
