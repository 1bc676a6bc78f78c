"""Arms on a vertical axis: their plan and their labels."""

import types

from clie_blocks.analysis.blind.engine import experiments
from clie_blocks.analysis.blind.engine.robot import draw_robot
from clie_blocks.analysis.blind.population import spatial_arms
from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.spatial_arms import LINKS_ONLY, SPATIAL, plan


def test_half_of_the_arms_are_healthy_and_the_others_have_every_effect_they_can():
    plans = [plan(3, index) for index in range(80)]
    assert all(names == () and size is None for names, size in plans[::2])
    assert {name for names, _ in plans[1::2] for name in names} == set(EFFECTS) - set(NEEDS)
    assert {size for _, size in plans[1::2]} == {"medium", "strong"}


def test_the_label_holds_what_is_there_and_what_the_links_hold(monkeypatch):
    monkeypatch.setattr(experiments, "DURATIONS", (2.0,))
    index = next(i for i in range(1, 80, 2) if plan(7001, i)[0] == ("dead_zone",))
    label = make_trial(SPATIAL, 7001, index).label
    assert label["labels"] == label["present"] == ["dead_zone"]
    assert label["wrong"].endswith("of the inertia") and label["ratio"] > 1.1
    assert label["robot"] == "spatial of 3" and len(label["effects"][0]["joints"]) == 1


def test_a_healthy_arm_has_nothing_that_could_be_named(monkeypatch):
    monkeypatch.setattr(spatial_arms, "draw_trial", lambda rng, *args: types.SimpleNamespace(
        robot=draw_robot(rng, "spatial"), label={}))
    label = make_trial(SPATIAL, 7001, 0).label
    assert label["labels"] == [LINKS_ONLY] and label["present"] == []
