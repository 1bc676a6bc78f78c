"""Theorem 2 on a robot: the modelling error behind a gap, and the radius that follows from it."""

import numpy as np
import pytest
from factories import Missing, make_problem
from scipy.signal import lfilter

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.ultimate_bound import modelling_error, ultimate_bound
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem


def test_the_modelling_error_is_what_made_the_prediction_error():
    period = 1e-3
    time = period * np.arange(12_000)
    problem = make_problem([np.zeros((12_000, 1))], held_out=0, period=period)
    torque = 0.02 * np.sin(2 * np.pi * 0.5 * time) * np.sin(np.pi * time / 12.0) ** 4
    nominal = build_hypothesis(problem, ())
    inertia, damping = nominal.values["inertia"][0], nominal.values["damping"][0]
    error = lfilter(*problem.law.torque_sensitivity(0, inertia, damping), torque)[:, None]
    missing = Missing(problem, (), nominal.values, error)
    found = modelling_error(missing, 0, METHOD.assessment.bound_band)[:, 0] * inertia
    assert found == pytest.approx(torque, abs=2e-4)


@pytest.mark.slow
def test_theorem_2_gives_a_smaller_radius_to_a_better_model():
    made = draw_cases(1, 6, ["coulomb"], ["single"], duration=12.0)[0]
    problem = Problem.from_logs(made.robot, made.records[:1])
    _, nominal = fit_nominal(problem, METHOD)
    before = ultimate_bound(nominal.hypothesis, METHOD.assessment)
    after = ultimate_bound(diagnose(problem).model.hypothesis, METHOD.assessment)
    assert after[0] < 0.4 * before[0] and after[1] < 0.4 * before[1]
