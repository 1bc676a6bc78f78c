"""Averaging against the exact Floquet rates, and the gain that balances any robot."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.theory.averaging import (
    averaged_matrix,
    averaged_rates,
    balanced_shape,
    steady_regressor,
)
from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.analysis.theory.convergence import PeriodicLoop, floquet_rates
from clie_blocks.excitation import paper_excitation

JOINTS = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
LOOP = PeriodicLoop(JOINTS, paper_excitation, q_d=paper.SET_POINT)


def test_averaging_is_right_for_small_gains_only():
    small, printed = (rates.per_joint for rates in floquet_rates(LOOP, [0.1, 20.0]))
    np.testing.assert_allclose(averaged_rates(LOOP, [0.1])[0], small, rtol=3e-3)
    assert averaged_rates(LOOP, [20.0])[0, 0] > 2 * printed[0]


def test_averaged_matrix_has_one_block_per_joint():
    matrix = averaged_matrix(LOOP)
    assert np.all(matrix[::2, 1::2] == 0) and np.all(matrix[1::2, ::2] == 0)
    assert np.all(np.linalg.eigvals(matrix).real > 0)


def test_steady_regressor_is_that_of_the_linear_loop():
    """Velocity at 1 Hz by hand: PE through B s / (s^2 + A_bar s + B_bar)."""
    dq = steady_regressor(LOOP)[0, :, 0]
    s = 2j * np.pi
    by_hand = 0.7 * JOINTS.b[0] * s / (s**2 + JOINTS.a_bar[0] * s + JOINTS.b_bar[0])
    assert 2 * np.abs(np.fft.rfft(dq)[2]) / dq.size == pytest.approx(abs(by_hand), rel=1e-6)


def test_balanced_gain_has_the_averaged_rate_of_the_papers_robot():
    shape = balanced_shape(LOOP)
    balanced = PeriodicLoop(JOINTS, paper_excitation, q_d=paper.SET_POINT, shape=shape)
    np.testing.assert_allclose(averaged_rates(balanced, [20.0]), 20 / 400, rtol=1e-9)
    np.testing.assert_allclose(averaged_rates(LOOP, [20.0]), 20 / 400, rtol=0.04)
