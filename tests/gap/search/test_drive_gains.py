"""A gain of one drive of an arm, sought from the stated joint model."""

import dataclasses

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem

from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.search.drive_gains import drive_gain_fits

PERIOD = 2e-3
TIME = PERIOD * np.arange(2000)[:, None]
MOTIONS = [0.4 * np.sin(np.array([[4.0 + k, 7.0 + 2.0 * k]]) * TIME) for k in range(3)]


def logged(*members, known_links=True):
    """Residuals and refitted nominal model of logs that a model with some causes has made."""
    problem = make_problem(MOTIONS, n=2, known_links=known_links, period=PERIOD)
    causes = [make_member(cause, problem, (1,), **values) for cause, values in members]
    truth = make_fit(problem, *causes).hypothesis
    rng, logs = np.random.default_rng(3), []
    for j, log in enumerate(problem.logs):
        q, u = truth.simulator.run(log, truth.of_log(j))
        logs.append(dataclasses.replace(log, q=q + 1e-5 * rng.standard_normal(q.shape), u=u))
    return fit_nominal(problem.with_log_list(logs), METHOD)


def test_the_drive_with_the_wrong_gain_is_found_beside_a_joint_model_that_absorbed_it():
    residuals, nominal = logged((drive.TORQUE_GAIN_ERROR, {"error": (0.0, -0.1)}))
    assert nominal.prior_violation.any()
    best, other = drive_gain_fits(nominal, residuals)
    assert best.hypothesis.members[0].joints == (1,) and other.hypothesis.members[0].joints == (0,)
    # without gravity no more than a valley, along which inertia and damping make up for it
    assert best.hypothesis.values["torque_gain_error.error"][1] == pytest.approx(-0.1, abs=0.05)
    assert best.excess < other.excess / 5.0 and best.penalty < other.penalty / 10.0


def test_causes_of_the_fit_stay_beside_the_gain():
    residuals, nominal = logged((drive.TORQUE_GAIN_ERROR, {"error": (0.0, -0.1)}),
                                (friction.COULOMB, {"level": (0.0, 0.5)}))
    rubs = make_member(friction.COULOMB, residuals.problem, (1,), level=(0.0, 0.5))
    base = fit(make_fit(residuals.problem, rubs).hypothesis, residuals)
    best, _ = drive_gain_fits(base, residuals)
    assert {member.name for member in best.hypothesis.members} == {"coulomb", "torque_gain_error"}
    assert best.excess < min(base.excess, nominal.excess) / 5.0


def test_no_gain_is_sought_beside_a_model_that_keeps_to_the_datasheet_or_without_links():
    residuals, nominal = logged()
    assert not nominal.prior_violation.any() and not drive_gain_fits(nominal, residuals)
    without, absorbed = logged((drive.TORQUE_GAIN_ERROR, {"error": (0.0, -0.1)}),
                               known_links=False)
    assert absorbed.prior_violation.any() and not drive_gain_fits(absorbed, without)
