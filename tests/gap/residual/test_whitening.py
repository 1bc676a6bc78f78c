"""Residuals by which causes compete, and those of the gap."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import unweighted


def test_in_the_gap_all_frequencies_count_alike_and_joints_by_their_noise(case):
    robot = case("none")
    residuals, nominal = fit_nominal(Problem.from_logs(robot.robot, robot.records), METHOD)
    plain = unweighted(residuals, nominal.hypothesis)
    log = residuals.problem.logs[0]
    time = residuals.problem.period * np.arange(len(log))
    norms = {}
    for frequency in (2.0, 20.0):  # Hz
        wave = 1e-4 * np.sin(2 * np.pi * frequency * time)
        error = np.repeat(wave[:, None], residuals.problem.n, axis=1)
        norms[frequency] = [
            np.array([np.sqrt(np.mean(part**2)) for part in one.whitened(error, 0)])
            for one in (residuals, plain)]
    expected = 1e-4 / np.sqrt(2.0) / np.array([noise.floor for noise in residuals.noises])
    for _, of_gap in norms.values():
        np.testing.assert_allclose(of_gap, expected, rtol=0.1)
    slow, fast = (whitened for whitened, _ in norms.values())
    assert not slow == pytest.approx(fast, rel=0.1)
