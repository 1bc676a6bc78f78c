"""Arms in space whose robot file states wrong links, or none."""

import collections

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.spatial_links import MASS_TOLERANCE
from clie_blocks.analysis.blind.link_data.robots import LINK_DATA, MISSING, WRONG, plan
from clie_blocks.analysis.blind.link_data.study import is_missed, score, terminal_lines
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.records import read_trial

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")


def test_half_of_the_arms_are_sound_and_the_effects_come_in_turn():
    plans = [plan(9, index) for index in range(40)]
    assert collections.Counter((hidden, bool(names)) for hidden, names, _ in plans) == {
        (WRONG, False): 10, (MISSING, False): 10, (WRONG, True): 10, (MISSING, True): 10}
    assert max(collections.Counter(names for _, names, _ in plans if names).values()) == 1
    assert {size for *_, size in plans} == {None, "medium", "strong"}


@pytest.mark.slow
def test_what_an_arm_is_and_what_its_file_says(tmp_path):
    off, bare = (make_trial(LINK_DATA, 9, index) for index in range(2))
    assert (np.abs(off.truth["heavier"]) >= 1.5 * MASS_TOLERANCE).all()
    write_trial(off, tmp_path / "off")
    write_trial(bare, tmp_path / "bare")
    robot, _ = read_trial(tmp_path / "off")
    assert robot.links.mass_tolerance == MASS_TOLERANCE
    stated, records = read_trial(tmp_path / "bare")
    assert "[links]" not in (tmp_path / "bare" / "robot.toml").read_text()
    assert not stated.nominal.gravity
    assert len(records) == 3 and records[0].q.shape[1] == bare.robot.n
    assert not list((tmp_path / "bare").glob("arm.*"))
    assert (off.label["present"], bare.label["labels"]) == (["parametric"], [MISSING])


def answer(**probability):
    return {"unexplained": False, "effects": [
        {"effect": name, "joint": None, "probability": p} for name, p in probability.items()]}


def test_a_wrong_file_is_a_right_answer_and_an_effect_that_is_not_there_is_none():
    label = {"labels": [WRONG], "wrong": "masses off by +10%", "robot": "articulated of 6",
             "present": ["parametric"], "kind": "misdescribed"}
    rubbing = {**label, "present": ["coulomb", "parametric"]}
    board = {"command": "clie blind --link-data 5", **score(
        {"right": answer(parametric=0.9), "wrong": answer(payload=0.8),
         "doubtful": answer(payload=0.4), "found": answer(coulomb=0.9),
         "beside": answer(coulomb=0.9, payload=0.6)},
        {"right": label, "wrong": label, "doubtful": label, "found": rubbing, "beside": rubbing},
        lambda name: name)}
    assert [row["named_falsely"] for row in board["rows"]] == [
        ["payload"], [], [], [], ["payload"]]
    assert board["by_hidden"][WRONG]["effect_named"]["hits"] == 2
    assert is_missed(board)
    assert f"{WRONG}: 40 % (2 of 5" in terminal_lines(board)[1]
