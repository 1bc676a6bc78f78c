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


def shares_in_answer_and_label(index, folder):
    """Shares of the causes of a robot by a diagnosis for them alone, and by the other engine."""
    trial = make_trial(MANY_CAUSES, 3, index)
    write_trial(trial, folder)
    effects = [one["effect"] for one in trial.label["effects"]]
    rows = diagnose(folder, effects=effects).to_dict()["effects"]
    return {row["effect"]: row["share"]["last"] for row in rows if "share" in row}, trial.label


@pytest.mark.slow
def test_a_diagnosis_and_the_engine_agree_on_what_each_cause_takes_at_one_joint(tmp_path):
    shares, label = shares_in_answer_and_label(7, tmp_path)
    assert label["robot"] == "pendulum of 1" and len(shares) == 3
    assert shares == pytest.approx(label["shares"], abs=0.1)


@pytest.mark.slow
def test_what_a_payload_takes_of_two_joints_is_not_absorbed_joint_by_joint(tmp_path):
    shares, label = shares_in_answer_and_label(32, tmp_path)
    assert label["robot"] == "arm of 2"
    assert shares["payload"] == pytest.approx(label["shares"]["payload"], abs=0.05)
