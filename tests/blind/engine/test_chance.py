"""Chance of the drives: alike for copies of an experiment, different between experiments."""

import numpy as np

from clie_blocks.analysis.blind.engine.chance import LaneRandom


def test_chance_is_the_same_for_copies_of_an_experiment_and_differs_between_experiments():
    one, two = object(), object()
    draw = LaneRandom((3, 1), [one, two, one], 2)("standard_normal")
    assert np.array_equal(draw[0], draw[2]) and not np.any(draw[0] == draw[1])
    assert np.array_equal(LaneRandom((3, 1), [one], 2)("standard_normal")[0], draw[0])
