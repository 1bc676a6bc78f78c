"""Robots with several effects at once: what is drawn, and what each effect is worth."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.many.robots import (
    COUNTS,
    MANY_CAUSES,
    NOT_TOGETHER,
    TRAINS,
    plan,
)
from clie_blocks.analysis.blind.population import arms_in_space
from clie_blocks.analysis.blind.population.catalogue import CATALOGUE
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap import diagnose

PLANS = [plan(3, index) for index in range(96)]


def test_every_robot_has_three_to_six_effects_that_go_together():
    for names, sizes, in_space in PLANS:
        assert len(names) == len(set(names)) == len(sizes) and len(names) in COUNTS
        assert all(len({*names} & {*group}) < 2 for group in NOT_TOGETHER)
        known = arms_in_space.NAMES if in_space else CATALOGUE
        assert set(names) <= set(known.effects)
        assert sizes.count("mild") < len(sizes)


def test_every_drive_train_rubs_and_a_quarter_of_the_robots_are_arms_in_space():
    trains = list(TRAINS.values())
    assert all(names[0] in trains[index % len(trains)][0]
               for index, (names, _, _) in enumerate(PLANS))
    assert sum(in_space for *_, in_space in PLANS) * 4 == len(PLANS)
    drawn = {name for names, _, in_space in PLANS if not in_space for name in names}
    assert drawn == {name for frictions, others in trains for name in (*frictions, *others)}


@pytest.mark.slow
def test_shares_say_what_the_gap_loses_without_an_effect():
    index = next(k for k, (names, _, in_space) in enumerate(PLANS)
                 if len(names) == 3 and not in_space)
    label = make_trial(MANY_CAUSES, 3, index).label
    assert set(label["shares"]) == {one["effect"] for one in label["effects"]}
    shares = np.array(list(label["shares"].values()))
    assert shares.max() > 0.2 and np.all(shares < 1.0)
    assert label["kind"] == "many" and label["ratio"] > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("index", [index for index, (names, _, in_space) in enumerate(PLANS)
                                   if "payload" in names and len(names) == 3 and not in_space][:1])
def test_a_diagnosis_and_the_engine_agree_on_what_each_cause_takes_of_the_gap(index, tmp_path):
    trial = make_trial(MANY_CAUSES, 3, index)
    write_trial(trial, tmp_path)
    effects = [one["effect"] for one in trial.label["effects"]]
    answer = diagnose(tmp_path, effects=effects).to_dict()
    shares = {row["effect"]: row["share"]["last"] for row in answer["effects"] if "share" in row}
    assert shares == pytest.approx(
        {name: trial.label["shares"][name] for name in shares}, abs=0.1)
    assert len(shares) >= 2
