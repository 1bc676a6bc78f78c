"""Methods of today on robots on which each must work, and stages that are taken away."""

import functools

import numpy as np
import pytest

from clie_blocks.analysis.blind.comparison import ablations
from clie_blocks.analysis.blind.comparison.baselines import BASELINES, smoothed_motion
from clie_blocks.analysis.blind.comparison.baselines.model_selection import bic
from clie_blocks.analysis.blind.scoring.decisions import Answer
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.causes import vocabulary
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.problem.problem import problem


@functools.cache
def robot(effect):
    kind = "none" if effect == "none" else "single"
    return draw_cases(1, 9, ["coulomb"], [kind], duration=8.0)[0]


@pytest.mark.parametrize("name", sorted(BASELINES))
def test_every_baseline_finds_plain_dry_friction(name):
    made = robot("coulomb")
    found = BASELINES[name](made.robot, made.records)
    said = Answer(found)
    assert said.decision == "coulomb" and said.joints["coulomb"] == {made.causes["coulomb"]}
    assert sum(said.probability.values()) >= 1.0 - 1e-9 and said.set_90[0] == "coulomb"
    assert found["gap_after"] < 0.5 * found["gap_before"]


@pytest.mark.parametrize("name", ["friction menu, closed loop", "simulator parameter fit"])
def test_a_healthy_robot_has_no_friction_by_simulation(name):
    made = robot("none")
    assert Answer(BASELINES[name](made.robot, made.records)).decision == "none"


def test_the_measured_motion_has_the_torque_of_a_cause():
    made = robot("coulomb")
    asked = problem(made.robot, made.records)
    (found,) = smoothed_motion.motions(asked, asked.fit[:1])
    level = np.full(asked.n, 0.3)
    torque = smoothed_motion.opposing(found, COULOMB, {"level": level})
    assert np.allclose(torque, 0.3 * np.sign(found.state.dq), atol=1e-12)


def test_bic_charges_each_number_the_log_of_the_samples():
    assert bic(8.0, 100, 3) - bic(8.0, 100, 1) == pytest.approx(2 * np.log(100))


def test_other_weighing_keeps_healthy_errors_at_size_one():
    made = robot("none")
    asked = problem(made.robot, made.records)
    rng = np.random.default_rng(0)
    from scipy.signal import lfilter

    from clie_blocks.analysis.gap.residual.sensitivity import noise_responses, sensor_sensitivity

    k, joints = 0, (asked.nominal.inertia, asked.nominal.damping)
    sensitivity = sensor_sensitivity(asked.law, k, *(numbers[k] for numbers in joints))
    for weigh in (ablations.unwhitened, ablations.as_torques):
        noise = weigh(asked, k, noise_responses(asked, k, *joints))
        error = lfilter(*sensitivity, noise.sigma * rng.standard_normal(400_000))
        seen = noise.whiten(noise.decimated(error, asked.period), noise.whitener)
        assert np.std(seen) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("weigh", [ablations.as_torques, ablations.unwhitened])
def test_another_weighing_reaches_the_bench_and_is_gone_afterwards(weigh):
    made = robot("coulomb")
    asked = problem(made.robot, made.records)
    own = fit_nominal(asked)[0].noises[0].whitener
    with ablations.weighing(weigh):
        other = fit_nominal(asked)[0].noises[0].whitener
    assert other.shape != own.shape or not np.allclose(other, own)
    assert np.array_equal(fit_nominal(asked)[0].noises[0].whitener, own)


def test_a_stage_comes_back_after_its_ablation():
    before = whitening.noise, vocabulary.homed
    made = robot("coulomb")
    found = ablations.ABLATIONS["no whitening"](made.robot, made.records)
    assert "coulomb" in Answer(found).order[:3]
    with pytest.raises(ValueError), ablations.replaced(vocabulary, "homed", None):
        raise ValueError
    assert (whitening.noise, vocabulary.homed) == before


def test_without_polish_numbers_stay_as_the_regression_left_them(monkeypatch):
    made, asked = robot("coulomb"), []
    own = ablations.fit

    def counted(start, bench, steps):
        asked.append(steps)
        return own(start, bench, steps)

    monkeypatch.setattr(ablations, "fit", counted)
    ablations.ABLATIONS["no polish"](made.robot, made.records)
    assert asked and not any(asked)


def test_without_priors_no_tolerance_is_left():
    made = robot("none")
    loose = problem(ablations.without_priors(made.robot), made.records)
    stated = problem(made.robot, made.records)
    assert np.all(loose.nominal.inertia_tolerance > 100 * stated.nominal.inertia_tolerance)
