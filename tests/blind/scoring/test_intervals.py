"""Figures with their intervals."""

import pytest

from clie_blocks.analysis.blind.scoring.intervals import estimate, rate, share_difference


def test_intervals_are_wilsons():
    assert rate([True] * 8 + [False] * 2)["interval"] == pytest.approx([0.4902, 0.9433], abs=1e-4)
    assert rate([])["rate"] is None


def test_a_figure_is_resampled_from_its_own_rows():
    found = estimate(range(101), max)
    assert found["value"] == 100 and 90 < found["interval"][0] <= found["interval"][1] == 100
    assert estimate([3.0], max) == {"value": 3.0, "of": 1, "interval": [3.0, 3.0]}
    assert estimate([], max) == {"value": None, "of": 0, "interval": None}


def test_two_methods_that_never_differ_are_not_proved_alike():
    low, high = share_difference([(True, True)] * 10)["interval"]
    assert low == -high and 0.1 < high < 0.4
    assert share_difference([(True, True)] * 1000)["interval"][1] < 0.01
