"""Two views of each run: what the law's encoder saw, and what the other one did."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.sensor import KINEMATIC_ERROR
from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE
from clie_blocks.analysis.gap.fitting.law_view import law_view
from clie_blocks.analysis.gap.problem.log import as_log
from clie_blocks.analysis.gap.problem.other_encoder import views_of_law, with_both_views
from clie_blocks.analysis.gap.residual.noise import Noise, decimated, sensor_noise_model, whiten
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.robot_sections import Encoder
from clie_blocks.analysis.records.two_encoders import with_law_encoder
from clie_blocks.linear_filters import lfilter
from tests.gap.factories import make_fit, make_member, make_problem, make_residual_model

TIME = np.arange(600) * 0.01
COURSES = [np.sin(rate * TIME)[:, None] for rate in (1.0, 1.3, 0.7)]
TWIST, ZERO = 0.02, 0.4  # share of the motion, and rad between the zeros of the encoders


def two_encoders(held_out=1):
    """Problem of three runs, whose other encoder turns further and has another zero."""
    problem = make_problem(COURSES, held_out=held_out)
    return with_both_views(problem.with_logs(
        lambda log: dataclasses.replace(log, other_q=(1 + TWIST) * log.q + ZERO)))


def test_without_a_second_encoder_nothing_changes():
    problem = make_problem(COURSES)
    assert with_both_views(problem) is problem and views_of_law(problem) is problem
    assert problem.runs == (0, 1, 2) and problem.fit_runs == 2
    fit, residuals = make_fit(problem), make_residual_model(problem)
    seen = law_view(fit, residuals)
    assert seen.fit is fit and seen.residuals is residuals and seen.views == 1.0


def test_every_run_is_seen_twice_and_counts_once():
    problem = two_encoders()
    assert [log.of_other_encoder for log in problem.fit] == [False, True] * 2
    assert [log.of_other_encoder for log in problem.held_out] == [False, True]
    assert problem.runs == (0, 0, 1, 1, 2, 2) and problem.fit_runs == 2
    first, second = problem.fit[:2]
    assert second.law_q is first.q and first.law_q is first.q
    np.testing.assert_allclose(second.q.mean(), first.q.mean())  # its zero is its own
    np.testing.assert_allclose(np.ptp(second.q), (1 + TWIST) * np.ptp(first.q))
    assert second.q_d is first.q_d and second.start is first.start
    assert views_of_law(problem).logs == problem.law_logs == problem.logs[::2]


def test_one_simulation_gives_what_both_encoders_see():
    problem = two_encoders()
    error = make_member(KINEMATIC_ERROR, problem, sine=0.03, cosine=0.0, order=3.0)
    hypothesis = make_fit(problem, error).hypothesis
    means = hypothesis.means_of_views([0, 1], [hypothesis.values])
    for j, of_view in enumerate(means):
        q, = hypothesis.positions(j, [hypothesis.values])
        np.testing.assert_allclose(of_view[0], decimated(q.T, problem.period).T, atol=1e-11)
    assert np.abs(means[0] - means[1]).max() > 0.01


def test_what_differs_between_runs_is_shared_by_their_views():
    problem = two_encoders()
    sines = np.array([[1.0], [2.0], [3.0]])
    member = make_member(PERIODIC_DISTURBANCE, problem, sine=sines)
    hypothesis = make_fit(problem, member).hypothesis
    key = "periodic_disturbance.sine"
    assert [hypothesis.of_log(j)[key][0] for j in range(6)] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert [one.log for one in hypothesis.free_parameters if one.key == key] == [0, 1]


def test_the_view_of_the_law_keeps_its_own_noise():
    problem = two_encoders()
    fit, whole = make_fit(problem), make_residual_model(problem)
    of_other = (Noise(3e-4, 3e-4, np.array([1.0])),)
    whole = dataclasses.replace(whole, other_noises={1: of_other, 3: of_other, 5: of_other})
    assert whole.floors == pytest.approx(np.sqrt((whole.noise(0, 0).floor**2 + 9e-8) / 2))
    seen = law_view(fit, whole)
    assert isinstance(seen.residuals, ResidualModel) and seen.views == 2.0
    assert len(seen.residuals.problem.logs) == len(seen.fit.chi2) == 3
    assert not seen.residuals.other_noises and seen.fit.hypothesis.problem.two_encoders


def test_noise_of_the_other_encoder_is_its_own_and_the_motion_by_that_of_the_law():
    """White noise of both, one round the loop: whitened to one, and uncorrelated."""
    problem = make_problem(COURSES)
    rng, (inertia, damping) = np.random.default_rng(3), (problem.nominal.inertia,
                                                         problem.nominal.damping)
    own, of_law = 2e-4, 5e-4
    log = problem.fit[0]
    noisy = [log.q + size * rng.standard_normal(log.q.shape) for size in (own, of_law)]
    view = dataclasses.replace(log, q=noisy[0], other_q=noisy[1], of_other_encoder=True)
    views = dataclasses.replace(problem, fit=(view,), held_out=(), two_encoders=True)
    found = sensor_noise_model(views, 0, noise_responses(views, 0, inertia, damping))
    assert found.sigma == pytest.approx(own, rel=0.1)
    round_loop, beside = of_law * rng.standard_normal(300_000), own * rng.standard_normal(300_000)
    sensitivity = problem.law.sensor_sensitivity(0, inertia[0], damping[0])
    error = beside + lfilter(*sensitivity, round_loop) - round_loop
    left = whiten(decimated(error, problem.period), found.whitener)
    assert np.mean(left**2) == pytest.approx(1.0, rel=0.15)  # both sizes are estimates
    assert abs(np.mean(left[1:] * left[:-1])) < 0.05


def test_a_log_of_two_encoders_keeps_the_other_one():
    robot = Robot(n=1, encoder=Encoder(mounting="motor side"))
    q = COURSES[0]
    record, = with_law_encoder([Record(time=TIME, q=q, u=q, q_motor=1.01 * q)], robot)
    log = as_log(record, robot, 0)
    np.testing.assert_allclose(log.q, 1.01 * q)
    np.testing.assert_allclose(log.other_q, q)
