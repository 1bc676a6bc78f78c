"""Figures of imperfect logs, from answers written by hand."""

import pytest

from clie_blocks.analysis.blind.imperfect.damages import DAMAGES
from clie_blocks.analysis.blind.report.imperfect import document, terminal_lines
from clie_blocks.analysis.blind.scoring.imperfect import names_fault, score_imperfect
from clie_blocks.analysis.report.render import markdown

STOPPED = {"error": "log-1.csv: q is in degrees; state the unit", "exit_code": 3}


def said(name, probability=0.98, verdict="effect", alike=(), **further):
    """Answer that gives one name a probability and the rest to unknown."""
    rest = 1 - probability
    return {"effects": [{"effect": name, "joint": [1], "probability": probability,
                         "alike": list(alike)},
                        {"effect": "unknown", "joint": None, "probability": rest}],
            "set_90": [name], "unexplained": False, "verdict": verdict, **further}


def label(damage, *effects, kind="single", **chosen):
    """Label of a robot with some effects whose files have a damage."""
    return {"kind": kind, "labels": list(effects) or ["none"], "robot": "arm of 2", "ratio": 4.0,
            "effects": [{"effect": name, "joints": [1]} for name in effects],
            "damage": {"damage": damage, **chosen}}


def score_of(answer, mark, twin=None):
    """Board of a study of one trial."""
    return score_imperfect({"t": answer}, {"t": twin or answer}, {"t": mark})


def hits(figure):
    """Hits and count of a share."""
    return figure["hits"], figure["of"]


@pytest.mark.parametrize("answer, mark, wrong", [
    (said("coulomb"), label("gap", "coulomb"), 0),
    (said("spring"), label("gap", "coulomb"), 1),
    (said("spring", 0.49), label("gap", "coulomb"), 0),
    (said("spring", 0.5), label("gap", "coulomb"), 1),
    (STOPPED, label("gap", "coulomb"), 0),
    (said("spring"), label("none", kind="unknown"), 1),
    (said("spring", verdict="unexplained"), label("none", kind="none"), 1),
    (said("parametric", verdict="parametric"), label("none", "coulomb"), 0),
    (said("encoder_quantization"), label("resolution_12_bit", "coulomb"), 0),
    (said("encoder_quantization"), label("gap", "coulomb"), 1),
    (said("velocity_filter_mismatch"), label("wrong_kd", kind="none"), 0),
    (said("spring"), label("none", "spring", "coulomb", kind="pair"), 0),
    (said("spring", alike=("gravity",)), label("none", "gravity"), 0),
    (said("spring", alike=("gravity",)), label("none", "coulomb"), 1),
    (said("torque_gain_error", alike=("parametric",)), label("none", kind="parametric"), 0),
    (said("torque_gain_error", alike=("parametric",)), label("none", "coulomb"), 1)])
def test_wrong_names(answer, mark, wrong):
    assert hits(score_of(answer, mark)["wrong_name"]) == (wrong, 1)


def test_a_wrong_name_may_be_of_the_right_family_and_as_wrong_without_the_damage():
    board = score_of(said("coulomb"), label("gap", "asymmetric_coulomb"), said("spring"))
    assert hits(board["wrong_name"]) == hits(board["wrong_name_on_twins"]) == (1, 1)
    assert hits(board["wrong_family"]) == (0, 1)
    assert hits(score_of(said("spring"), label("gap", kind="none"))["wrong_family"]) == (1, 1)


@pytest.mark.parametrize("answer, mark, alarm", [
    (said("spring"), label("gap", kind="none"), (1, 1)),
    (said("spring", 0.3), label("gap", kind="none"), (1, 1)),
    (said("spring", 0.3, verdict="unexplained"), label("gap", kind="none"), (0, 1)),
    (said("none", verdict="none"), label("none", kind="none"), (0, 1)),
    (said("spring"), label("none", kind="parametric"), (1, 1)),
    (STOPPED, label("none", kind="none"), (0, 1)),
    (said("velocity_filter_mismatch"), label("wrong_kp", kind="none"), (0, 1)),
    (said("spring"), label("none", "coulomb"), (0, 0))])
def test_false_alarms(answer, mark, alarm):
    assert hits(score_of(answer, mark)["false_alarm"]) == alarm


@pytest.mark.parametrize("damage, chosen, answer, named", [
    ("positions_in_degrees", {}, STOPPED, True),
    ("positions_in_degrees", {}, {**STOPPED, "exit_code": 70}, False),
    ("clock_in_ms", {}, STOPPED, False),
    ("clock_in_ms", {}, said("none", log={"corrections": [
        {"what": "The clock is in ms.", "signal": "time"}]}), True),
    ("clock_in_ms", {}, said("none", log={"corrections": [
        {"what": "A gap of 50 ms."}, {"what": "The clock is jittery."}]}), False),
    ("lost_pe", {}, said("unknown", log={"corrections": [], "warnings": ["pe is not logged."]}),
     True),
    ("lost_pe", {}, said("unknown", next_experiment="log pe as well"), False),
    ("command_sign", {"joint": 2}, said("none"), False),
    ("command_sign", {"joint": 2},
     said("unknown", controller="The command of joint2 has the opposite sign."), True),
    ("wrong_kp", {"joint": 2}, said("none", description=[{"key": "controller.Kp", "joint": 2}]),
     True),
    ("wrong_kp", {"joint": 2}, said("none", description=[{"key": "controller.Kp", "joint": 1}]),
     False),
    ("wrong_link_mass", {"joint": 2}, said("parametric", verdict="parametric"), True),
    ("wrong_link_mass", {"joint": 2}, said("payload"), False),
    ("wrong_motor_inertia", {"joint": 3}, said("coupling", description=[
        {"key": "motor.inertia_kgm2", "joint": 3}]), True),
    ("wrong_motor_inertia", {"joint": 3}, said("coupling", description=[
        {"key": "motor.inertia_kgm2", "joint": 2}]), False),
    ("resolution_12_bit", {}, said("encoder_quantization"), True)])
def test_a_fault_is_named_in_words_of_its_own(damage, chosen, answer, named):
    assert names_fault(DAMAGES[damage], chosen, answer) is named
    board = score_of(answer, label(damage, kind="none", **chosen), said("none", verdict="none"))
    assert hits(board["named"]) == (int(named), 1)
    assert hits(board["named_on_twins"]) == (0, 1)


def test_harmless_damages_are_held_against_the_twins():
    marks = {name: label("gap", "coulomb") for name in "abcd"} | {"e": label("noise_x5", "spring")}
    right, wrong = said("coulomb"), said("unknown", verdict="unexplained")
    twins = dict.fromkeys("abcde", right)
    board = score_imperfect({**twins, "b": wrong, "c": STOPPED}, {**twins, "d": wrong}, marks)
    assert board["harmless"]["value"] == pytest.approx(1 / 4 - 2 / 4)
    assert board["harmless"]["of"] == 4
    assert {row["key"]: row["reached"] for row in board["targets"]}["harmless"] != "yes"


def test_effects_of_several_must_all_come_first():
    pair = label("gap", "spring", "coulomb", kind="pair")
    both = said("spring") | {"effects": [
        {"effect": name, "joint": [1], "probability": 0.9} for name in ("coulomb", "spring")]}
    assert hits(score_of(both, pair)["right"]) == (1, 1)
    assert hits(score_of(said("spring"), pair)["right"]) == (0, 1)


def test_sound_trials_are_neither_stopped_nor_corrected():
    corrected = said("none", verdict="none", log={"corrections": [{"what": "sign turned"}]})
    marks = dict.fromkeys("abcd", label("none", kind="none"))
    answers = {"a": said("none", verdict="none"), "b": corrected, "c": STOPPED,
               "d": said("none", verdict="none", log={"corrections": [], "warnings": ["coarse"]})}
    assert hits(score_imperfect(answers, answers, marks)["fault_of_sound"]) == (2, 4)


@pytest.mark.parametrize("kind, faults", [("parametric", 0), ("none", 1)])
def test_numbers_that_are_off_may_be_corrected(kind, faults):
    answer = said("parametric", verdict="parametric", description=[
        {"key": "motor.inertia_kgm2", "joint": 1}])
    assert hits(score_of(answer, label("none", kind=kind))["fault_of_sound"]) == (faults, 1)


def test_faults_of_the_program_and_missed_effects():
    marks = dict.fromkeys("abcde", label("gap", "coulomb"))
    answers = {"a": {"error": "fault", "exit_code": 70}, "b": {"error": "none", "exit_code": 124},
               "c": STOPPED, "d": said("none", verdict="none"), "e": {**STOPPED, "exit_code": -11}}
    board = score_imperfect(answers, answers, marks)
    assert hits(board["broken"]) == (3, 5) and hits(board["stopped"]) == (4, 5)
    assert hits(board["missed"]) == (1, 1)


def test_the_page_has_a_row_per_damage_and_every_wrong_name():
    marks = {"a": label("none", kind="none"), "b": label("gap", "coulomb"),
             "c": label("lost_pe", "coulomb")}
    answers = {"a": said("none", verdict="none"), "b": said("step_fault"), "c": STOPPED}
    board = {"seeds": [7], "command": "clie blind --imperfect --trials 3 --seed 7",
             **score_imperfect(answers, dict.fromkeys("abc", said("coulomb")), marks)}
    text = markdown(document(board))
    assert "| sound " in text and "| gap " in text and "step_fault 0.98" in text
    assert "clie blind --imperfect --trials 3 --seed 7" in text and "q is in degrees" in text
    assert any("wrong name" in line and "1 of 3" in line for line in terminal_lines(board))
