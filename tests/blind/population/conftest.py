"""One trial that several tests look at."""

import pytest

from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.standard import STANDARD, plan


@pytest.fixture(scope="session")
def healthy_trial():
    """Index and trial of a healthy robot of seed 2001."""
    index = next(i for i in range(60) if plan(2001, i)[0] == "none")
    return index, make_trial(STANDARD, 2001, index)
