"""The diagnosis with one of its stages removed."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.blind.comparison import ablations
from clie_blocks.analysis.blind.scoring.decisions import Answer
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.residual.noise import decimated, whiten
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses
from clie_blocks.analysis.gap.stages import STAGES

NOISE_MODELS = ablations.noise_without_whitening, ablations.noise_without_sensitivity


@pytest.mark.slow
@pytest.mark.parametrize("noise_model", NOISE_MODELS)
def test_other_weighing_keeps_healthy_errors_at_size_one(own_robot, noise_model):
    problem, _ = own_robot("none")
    k, joint_model = 0, (problem.nominal.inertia, problem.nominal.damping)
    noise = noise_model(problem, k, noise_responses(problem, k, *joint_model))
    sensitivity = problem.law.sensor_sensitivity(k, *(values[k] for values in joint_model))
    white = np.random.default_rng(0).standard_normal(400_000)
    error = lfilter(*sensitivity, noise.sigma * white)
    residual = whiten(decimated(error, problem.period), noise.whitener)
    assert np.std(residual) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("noise_model", NOISE_MODELS)
def test_another_noise_model_reaches_the_whitening(own_robot, noise_model):
    problem, _ = own_robot("coulomb")
    own = fit_nominal(problem, METHOD)[0].noises[0].whitener
    other = fit_nominal(problem, METHOD, noise_model)[0].noises[0].whitener
    assert other.shape != own.shape or not np.allclose(other, own)
    assert ablations.with_noise_model(noise_model).steps.noise_model is noise_model


@pytest.mark.slow
def test_a_diagnosis_without_whitening_still_looks_at_the_right_cause(own_robot):
    problem, _ = own_robot("coulomb")
    answer = Answer(ablations.ABLATIONS["no whitening"](problem))
    assert "coulomb" in answer.order[:3]


@pytest.mark.slow
def test_without_polish_parameters_stay_as_the_regression_left_them(own_robot):
    problem, _ = own_robot("coulomb")
    fits = []

    def recorded_race(residuals, nominal, candidates, finalists):
        raced = race(residuals, nominal, candidates, finalists)
        fits.extend(raced)
        return raced

    race = STAGES.steps.search.race
    steps = dataclasses.replace(STAGES.steps, search=dataclasses.replace(
        STAGES.steps.search, race=recorded_race))
    stages = dataclasses.replace(ablations.UNPOLISHED, steps=steps)
    changed = {one.name for one, other in zip(METHOD.thresholds(), ablations.NO_STEPS.thresholds())
               if one.value != other.value}
    assert all(name.endswith(("_steps", "_rounds")) for name in changed)
    answer = ablations.diagnose_with(problem, ablations.NO_STEPS, stages)
    assert fits and all(fit.iterations == 0 for fit in fits)
    assert "coulomb" in Answer(answer).order[:3]


def test_without_priors_no_tolerance_is_left(own_robot):
    stated, _ = own_robot("none")
    loose = ablations.without_priors(stated)
    assert np.all(loose.nominal.inertia_tolerance > 100 * stated.nominal.inertia_tolerance)
    assert len(loose.held_out) == len(stated.held_out)
