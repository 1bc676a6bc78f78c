"""Sound robots with a false word about their controller: one lie each, and no joint accused."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.controller import Controller  # noqa: E402
from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth, neutral  # noqa: E402
from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.maker import make_trial  # noqa: E402
from clie_blocks.analysis.blind.population.wrong_controller import CONTROLLERS, WRONG  # noqa: E402
from clie_blocks.analysis.blind.scoring import robustness  # noqa: E402
from clie_blocks.analysis.blind.scoring.robustness import CONTROLLER, outcome  # noqa: E402
from clie_blocks.analysis.gap.batch import diagnose_trial, find_tasks  # noqa: E402


@pytest.mark.parametrize("name", WRONG)
def test_one_word_about_the_controller_is_false_and_all_else_is_true(name):
    rng = np.random.default_rng(7)
    robot = draw_robot(rng)
    truth = draw_truth(rng, robot)
    stated, ran, told = WRONG[name](rng, robot, truth)
    lies = {field.name for field in dataclasses.fields(robot)
            if not np.array_equal(getattr(stated, field.name), getattr(robot, field.name))}
    changed = {key for key in truth if not np.array_equal(truth[key], ran[key])}
    assert lies <= {"discretisation", "corners", "kd", "kp"} and changed <= {"behind"}
    assert len(lies | changed) == 1 and told


def test_a_controller_behind_answers_to_the_row_before():
    rng = np.random.default_rng(2)
    robot = draw_robot(rng, "axes")
    rows = [tuple(rng.standard_normal((3, 1, robot.n))) for _ in range(20)]
    prompt, late = ({**neutral(robot.n), "behind": np.full(robot.n, behind)}
                    for behind in (0.0, 1.0))
    said = [[one(*row) for row in rows] for one in (
        Controller(robot, {key: value[None] for key, value in p.items()}) for p in (prompt, late))]
    delayed = Controller(robot, {key: value[None] for key, value in prompt.items()})
    assert np.array_equal(said[1], [delayed(*row) for row in [rows[0], *rows[:-1]]])
    assert not np.array_equal(*said)


def answer(*effects, decisions=()):
    return {"effects": [{"effect": name, "joint": [1], "probability": 0.9} for name in effects],
            "set_90": list(effects), "unexplained": effects == ("unknown",),
            "decisions": list(decisions), "gap_before": 1e-3, "gap_after": 1e-3, "seconds": 1.0}


@pytest.mark.parametrize(("said", "outcome_of_it"), [
    (answer("velocity_filter_mismatch"), "named"),
    (answer("none", decisions=["the filter runs as 'zoh'"]), "named"),
    (answer("unknown"), "unknown"), (answer("parametric"), "missed"), (answer("none"), "missed"),
    (answer("time_delay", decisions=["anything"]), "accused"),
    ({"error": "too short", "exit_code": 4}, "failed")])
def test_an_outcome_is_named_unknown_missed_or_a_false_accusation(said, outcome_of_it):
    assert outcome(said, [CONTROLLER]) == outcome_of_it


def test_words_of_the_controller_check_name_no_effect_of_the_robot():
    said = answer("unknown", decisions=["the filter runs as 'zoh'"])
    assert outcome(said, ["coulomb"]) == "unknown" and outcome(said, [CONTROLLER]) == "named"
    assert outcome(answer("coulomb"), ["coulomb"]) == "named"
    assert outcome(answer("coulomb"), []) == "accused"


def test_the_scores_are_shares_by_what_is_wrong():
    labels = {f"trial-{i:03d}": {"labels": [name], "wrong": "x 1.1", "robot": "arm of 2",
                                  "present": [CONTROLLER]}
              for i, name in enumerate(WRONG)}
    found = robustness.scored(
        {name: answer("unknown" if i else "spring") for i, name in enumerate(labels)}, labels)
    assert found["accused"]["hits"] == 1 and found["unknown"]["hits"] == len(WRONG) - 1
    assert found["by_hidden"][next(iter(WRONG))]["accused"]["rate"] == 1.0


@pytest.mark.parametrize("index", [1, 3], ids=["corner", "gain"])
def test_a_wrong_word_about_the_controller_is_no_fault_of_the_robot(index, tmp_path):
    trial = make_trial(CONTROLLERS, 30, index)
    assert trial.label["labels"] == [list(WRONG)[index]]
    write_trial(trial, tmp_path / "trial")
    said = diagnose_trial(find_tasks([tmp_path / "trial"])[0])
    assert outcome(said, trial.label["present"]) == "named"
