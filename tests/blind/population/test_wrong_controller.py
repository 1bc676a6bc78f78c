"""Healthy robots with one false statement about their controller."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.wrong_controller import CONTROLLERS, MISSTATEMENTS
from clie_blocks.analysis.blind.scoring.robustness import outcome
from clie_blocks.analysis.gap import diagnose, read


@pytest.mark.parametrize("name", MISSTATEMENTS)
def test_one_statement_about_the_controller_is_false_and_all_else_is_true(name):
    rng = np.random.default_rng(7)
    robot = draw_robot(rng)
    truth = draw_truth(rng, robot)
    stated, ran, text = MISSTATEMENTS[name](rng, robot, truth)
    false = {field.name for field in dataclasses.fields(robot)
            if not np.array_equal(getattr(stated, field.name), getattr(robot, field.name))}
    changed = {key for key in truth if not np.array_equal(truth[key], ran[key])}
    assert false <= {"discretisation", "corners", "kd", "kp"} and changed <= {"behind"}
    assert len(false | changed) == 1 and text


@pytest.mark.parametrize("index", [1, 3], ids=["corner", "gain"])
def test_a_wrong_statement_about_the_controller_is_not_attributed_to_the_robot(index, tmp_path):
    trial = make_trial(CONTROLLERS, 30, index)
    assert trial.label["labels"] == [list(MISSTATEMENTS)[index]]
    write_trial(trial, tmp_path / "trial")
    answer = diagnose(read(tmp_path / "trial")).to_dict()
    assert outcome(answer, trial.label["present"]) == "named"
