"""Which of two readings of a command is taken, and how much the choice may mislead."""

import pytest

from clie_blocks.analysis.gap.command_reading import _probability
from clie_blocks.analysis.gap.method import METHOD


@pytest.mark.parametrize("best, other, apart, least, most", [
    (1.0, 500.0, 500.0, 0.999, 1.0),  # one leaves next to nothing: no doubt
    (480.0, 500.0, 500.0, 0.5, 0.75),  # both leave the same, and are far apart: a toss
    (480.0, 500.0, 5.0, 0.999, 1.0),  # a toss, but it does not matter
    (480.0, 500.0, float("inf"), 0.5, 0.75)])  # one of them diverges
def test_a_choice_is_doubted_where_it_is_open_and_matters(best, other, apart, least, most):
    assert least <= _probability(best, other, apart, METHOD.calibration) <= most
