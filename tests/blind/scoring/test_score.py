"""Figures of the scoreboard on studies whose outcome is plain."""

import pytest

from clie_blocks.analysis.blind.scoring.score import score


def test_a_perfect_study_has_full_marks(plain_study):
    board = score(plain_study.right_answers, plain_study.labels)
    full = ("top_1", "top_3", "family", "joint", "effect_and_joint", "all_decisions",
            "parametric_named", "unknown_detected", "pair_recall", "pair_all_in_top_2",
            "triple_recall", "triple_all_in_top_3", "set_coverage_all")
    assert all(board[key]["rate"] == 1 for key in full)
    assert all(board[key]["rate"] == 0 for key in (
        "false_alarm", "false_structure", "unknown_called_none", "false_unknown"))
    assert board["calibration"]["brier"]["value"] == pytest.approx(1e-4)
    assert board["shrinkage"]["median"] == board["against_true_model"]["median"] == 1.0
    assert board["by_gear"]["above 50"]["of"] == 1
    assert board["wrong"] == []


def test_a_study_that_always_answers_none_finds_nothing_and_alarms_nobody(plain_study):
    labels = plain_study.labels
    board = score({kind: plain_study.answer("none", after=4e-4) for kind in labels}, labels)
    assert board["top_1"]["rate"] == board["pair_recall"]["rate"] == 0
    assert board["unknown_called_none"]["rate"] == 1 and board["false_alarm"]["rate"] == 0
    assert board["shrinkage"]["median"] == pytest.approx(0.0)
    assert [row["trial"] for row in board["wrong"]] == [
        "pair", "parametric", "single", "triple", "unknown"]


def test_the_wrong_joint_and_the_wrong_friction_count_where_they_should(plain_study):
    right, labels = plain_study.right_answers, plain_study.labels
    elsewhere = score(right | {"single": plain_study.answer("coulomb", joint=2)}, labels)
    assert elsewhere["top_1"]["rate"] == 1 and elsewhere["effect_and_joint"]["rate"] == 0
    relative = score(right | {"single": plain_study.answer("stribeck")}, labels)
    assert relative["top_1"]["rate"] == 0 and relative["family"]["rate"] == 1
    assert relative["confusion"]["coulomb"] == {"stribeck": 1}


def test_a_diagnosis_that_failed_is_wrong_and_named(plain_study):
    failed = {"error": "too short", "exit_code": 4}
    board = score(plain_study.right_answers | {"single": failed}, plain_study.labels)
    assert board["failed"] == ["single"] and board["top_1"]["rate"] == 0


def test_a_wrong_motor_constant_is_an_error_of_the_drives_gain(plain_study):
    labels = {kind: {**label, "labels": ["torque_gain"]} if kind == "parametric" else label
              for kind, label in plain_study.labels.items()}
    answers = plain_study.right_answers | {"parametric": plain_study.answer("torque_gain_error")}
    board = score(answers, labels)
    assert board["parametric_named"]["rate"] == 1 and board["false_structure"]["rate"] == 0
    assert board["set_coverage_all"]["rate"] == 1
    of_rotor = score(answers, plain_study.labels)
    assert of_rotor["parametric_named"]["rate"] == 0 and of_rotor["false_structure"]["rate"] == 1
