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


def test_in_a_log_with_a_gap_the_same_rows_count(case):
    robot = case("coulomb")
    record = robot.records[0]
    kept = np.delete(np.arange(len(record)), np.arange(700, 760))
    signals = {name: getattr(record, name)[kept] for name in ("time", "valid", *record.signals)}
    logs = [record.replace(**signals, segments=()), *robot.records[1:]]
    residuals, nominal = fit_nominal(Problem.from_logs(robot.robot, logs), METHOD)
    plain = unweighted(residuals, nominal.hypothesis)
    error = np.random.default_rng(0).standard_normal((len(residuals.problem.logs[0]),
                                                      residuals.problem.n))
    for k, parts in enumerate(zip(residuals.whitened(error, 0), plain.whitened(error, 0))):
        rows = [np.flatnonzero(part) for part in parts]
        np.testing.assert_array_equal(*rows)
        assert len(rows[0]) < len(parts[0])
        basis = plain.initial_responses[0][k]
        np.testing.assert_allclose(basis.T @ parts[1], 0.0, atol=1e-9 * np.linalg.norm(parts[1]))
