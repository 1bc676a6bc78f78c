"""Rejected draws are drawn again, and their reasons kept."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.population.maker import (
    Population,
    RejectedError,
    Trial,
    make_trial,
)


def test_a_rejected_draw_is_drawn_again_and_its_reason_kept():
    drawn = []

    def draw(rng, seed, index):
        drawn.append(rng.random())
        if len(drawn) < 3:
            raise RejectedError(f"draw {len(drawn)}")
        return Trial(None, [], [], {"seed": seed, "index": index})

    trial = make_trial(Population(draw, (7,)), 3, 4)
    assert trial.label == {"seed": 3, "index": 4, "rejected": ["draw 1", "draw 2"]}
    assert len(set(drawn)) == 3
    assert drawn[2] == np.random.default_rng([3, 4, 2, 7]).random()


def test_a_population_without_any_accepted_draw_reports_why():
    def draw(rng, seed, index):
        raise RejectedError("too heavy")

    with pytest.raises(RuntimeError, match="trial 4 of seed 3: .*too heavy"):
        make_trial(Population(draw), 3, 4)
