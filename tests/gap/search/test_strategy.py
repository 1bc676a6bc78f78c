"""How far the search over several causes goes: what is left, and what a further one predicts."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.search.candidates import Candidate
from clie_blocks.analysis.gap.search.strategy import SEARCH_STEPS, search_causes

WHOLE = 1000.0  # excess of the refitted nominal model
SAMPLES = 1000.0


def cause(name):
    return SimpleNamespace(name=name, key=name, numbers=(), without=(), block=name,
                           needs_links=False, pieces=())


FIRST, SECOND, THIRD = (SimpleNamespace(cause=cause(name), values={}) for name in "abc")


@dataclasses.dataclass(frozen=True, eq=False)
class StubFit:
    """A fit of one joint and one log that leaves an excess per sample."""

    excess: float
    hypothesis: SimpleNamespace
    samples: np.ndarray

    @property
    def cost(self):
        return (1.0 + self.excess) * SAMPLES

    total = cost


def leaving(excess, *members):
    problem = SimpleNamespace(fit=(None,), chain=SimpleNamespace(known=True))
    return StubFit(excess, SimpleNamespace(members=members, problem=problem, values={}),
                   np.array([[SAMPLES]]))


@pytest.fixture
def searched():
    """Function from what a pair leaves, and what a third cause predicts, to the fits made."""
    def run(pair, third):
        fits = {(FIRST,): 900.0, (FIRST, SECOND): pair, (FIRST, SECOND, THIRD): 1.0}

        def singles(screen, residuals, fit, causes):
            if len(fit.hypothesis.members) == 2:
                return [Candidate((THIRD,), (pair - third) * SAMPLES)]
            more = FIRST if not fit.hypothesis.members else SECOND
            return [Candidate((more,), 0.5 * WHOLE * SAMPLES)]

        def race(residuals, nominal, candidates, finalists):
            def names(members):
                return {member.cause.name for member in members}

            return [leaving(excess, *members) for candidate in candidates
                    for members, excess in fits.items()
                    if names(members) == names(candidate.members)
                    and (candidate.extends is None or candidate.score)]

        steps = dataclasses.replace(
            SEARCH_STEPS, screen=lambda *_: None, screen_residual=lambda *_: None,
            singles=singles, pairs=lambda screen: [], race=race,
            prune=lambda fit, residuals, excess_of_nominal: fit)
        return search_causes(SimpleNamespace(method=METHOD), leaving(WHOLE), CAUSES, steps)
    return run


@pytest.mark.parametrize("pair, third, sought", [
    (290.0, 280.0, True),  # the pair explains most of it: a third is sought in any case
    (310.0, 80.0, True),  # it does not, but a third is predicted to explain most of the rest
    (310.0, 100.0, False),  # neither
    (2.0, 0.0, True),  # the same, of little
    (0.6, 0.0, False),  # a third cause would cost more than it could gain
    (0.2, 0.0, False)])  # nothing is left
def test_a_third_cause_is_sought_where_a_pair_does_well_or_a_third_is_predicted_to(
        searched, pair, third, sought):
    fits = searched(pair, third)
    assert any(len(fit.hypothesis.members) == 2 for fit in fits)
    assert any(len(fit.hypothesis.members) == 3 for fit in fits) == sought
