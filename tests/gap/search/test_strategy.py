"""How far the search over several causes goes: what is left, and what a further one promises."""

from types import SimpleNamespace

import pytest

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.search import strategy

WHOLE = 1000.0  # excess of the refitted nominal model


def leaving(excess, causes):
    """A fit with some causes."""
    return SimpleNamespace(left=excess, total=excess,
                           hypothesis=SimpleNamespace(members=("cause",) * causes))


@pytest.fixture
def explored(monkeypatch):
    """Function from what a pair leaves, and what a third cause promises, to the fits made."""
    def run(pair, third):
        races = iter([[leaving(900.0, 1)], [leaving(pair, 2)], [leaving(1.0, 3)]])
        stages = {
            "screen": lambda *a: None, "singles": lambda *a: [], "pairs": lambda *a: [],
            "believed": lambda *a: [], "promising": lambda *a: True,
            "race": lambda *a: next(races),
            "excess": lambda fit: fit.left, "promised": lambda candidate: candidate.left,
            "_completed": lambda bench, base, fits, causes: fits, "_distinct": lambda some: some,
            "_with_another": lambda *a: [SimpleNamespace(left=third, members=a)]}
        for name, stage in stages.items():
            monkeypatch.setattr(strategy, name, stage)
        return strategy.search_causes(None, leaving(WHOLE, 0), CAUSES)
    return run


@pytest.mark.parametrize("pair, third, sought", [
    (290.0, 280.0, True),  # the pair explains most of it: a third is sought, promising or not
    (310.0, 80.0, True),  # it does not, but a third promises most of the rest
    (310.0, 100.0, False),  # neither
    (2.0, 0.0, True),  # as said, of little
    (0.6, 0.0, False),  # a third cause would cost more than it could bring
    (0.2, 0.0, False)])  # nothing is left
def test_a_third_cause_is_sought_where_a_pair_does_well_or_a_third_promises_to(
        explored, pair, third, sought):
    assert any(len(fit.hypothesis.members) == 3 for fit in explored(pair, third)) == sought
