"""Sensitivities of the loop, where their formulas lose digits."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.residual.sensitivity import held_plant


def test_a_joint_without_damping_moves_as_a_double_integrator():
    period = 2e-3
    numerator, denominator = held_plant(1.0, 0.0, period)
    half = period**2 / 2
    assert numerator == pytest.approx([0.0, half, half], rel=1e-5)
    np.testing.assert_allclose(denominator, [1.0, -2.0, 1.0], atol=1e-8)
