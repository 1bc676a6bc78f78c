"""The price of a parameter."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.comparison.baselines.model_selection import bic


def test_bic_charges_each_parameter_the_log_of_the_samples():
    assert bic(8.0, 100, 3) - bic(8.0, 100, 1) == pytest.approx(2 * np.log(100))
