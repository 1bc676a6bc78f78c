"""What a report says first, in words: from answers, without a diagnosis."""

import pytest

from clie_blocks.analysis.gap.report.causes import TOLD_APART, confusion_section
from clie_blocks.analysis.gap.report.document import sentence
from clie_blocks.analysis.gap.report.summary import summary_line as line
from clie_blocks.analysis.gap.report.wording import FOREIGN
from clie_blocks.analysis.gap.verdict.confounders import CONTACT, SOFT_STOP


def test_sentence_names_cause_joint_and_gain():
    told = {"verdict": "effect", "set_90": ["coulomb"],
            "closed_percent": {"value": 96.4, "unseen_data": True}, "effects": [
                {"effect": "coulomb", "joint": [2], "probability": 0.93},
                {"effect": "unknown", "joint": None, "probability": 0.07}]}
    assert sentence(told, ("shoulder", "elbow")) == (
        "The model lacks coulomb at elbow (93 %); with it the model loses 96.4 % of its "
        "reducible gap on unseen data.")
    sure = {**told, "families": {"friction": 0.97}}
    assert sentence(sure, ("shoulder", "elbow")) == sentence(told, ("shoulder", "elbow"))
    sure["effects"] = [{"effect": "coulomb", "joint": [2], "probability": 0.5}]
    assert "coulomb at elbow (50 %; friction of some kind 97 %); with it" in sentence(
        sure, ("shoulder", "elbow"))
    left = sentence({**told, "verdict": "unexplained"}, ("shoulder", "elbow"))
    assert "no effect" in left and "nearest removes 96.4 %" in left
    assert "noise" in sentence({**told, "verdict": "none"}, ())
    unsure = {"verdict": "not_identifiable", "set_90": ["coulomb", "stribeck", "presliding"]}
    assert sentence({**told, **unsure}, ()).startswith(
        "These logs cannot tell which it is: coulomb, stribeck or presliding; with the likeliest ")


def test_a_family_is_named_where_no_effect_is_likely():
    told = {"verdict": "not_identifiable", "set_90": ["coulomb", "stribeck", "spring"],
            "closed_percent": {"value": None}, "families": {"friction": 0.7, "load": 0.2},
            "effects": [{"effect": "unknown", "joint": None, "probability": 0.1},
                        {"effect": "coulomb", "joint": [2], "probability": 0.4}]}
    said = ("These logs cannot tell which it is: friction of some kind (70 %), most likely "
            "coulomb at b (40 %).")
    assert sentence(told, ("a", "b")) == said
    assert "coulomb, stribeck or spring" in sentence({**told, "families": {"load": 0.4}}, "ab")


def test_no_family_is_named_where_an_effect_of_another_is_as_likely():
    told = {"verdict": "not_identifiable", "set_90": ["torque_gain_error", "payload"],
            "closed_percent": {"value": None}, "families": {"load": 0.502, "drive": 0.498},
            "effects": [{"effect": "torque_gain_error", "joint": [1], "probability": 0.498},
                        {"effect": "payload", "joint": [1], "probability": 0.496}]}
    assert sentence(told, ("a",)) == (
        "These logs cannot tell which it is: torque gain error or payload.")


def test_wrong_numbers_are_named_with_what_is_stated():
    told = {"verdict": "parametric", "closed_percent": {"value": 0.0, "unseen_data": True},
            "joint_model": {
                "inertia": {"value": [0.02, 0.05], "stated": [0.02, 0.04], "unit": "kg m^2",
                            "tolerance": [1e-4, 4e-4]},
                "damping": {"value": [0.2, 0.21], "stated": [0.1, 0.2], "unit": "N m s/rad",
                            "tolerance": [0.015, 0.03]}}}
    assert sentence(told, ("a", "b")) == (
        "The model is right but its numbers are not: inertia at b 0.05 kg m^2, stated 0.04; "
        "damping at a 0.2 N m s/rad, stated 0.1.")
    nothing = {**told, "joint_model": {}}
    assert sentence(nothing, ("a", "b")) == "The model is right but its numbers are not."


def test_a_law_that_did_not_run_is_no_nearest_effect():
    told = {"verdict": "unexplained", "closed_percent": {"value": 99.0, "unseen_data": True},
            "controller_as_stated": False, "effects": []}
    assert "its controller is not the stated one, and the law that ran removes 99 %" in sentence(
        told, ("a",))


def test_what_is_sure_is_told_beside_the_unknown():
    told = {"verdict": "unexplained", "closed_percent": {"value": 70.0, "unseen_data": True},
            "effects": [
        {"effect": "unknown", "joint": None, "probability": 0.9},
        {"effect": "actuator_lag", "joint": [1], "probability": 0.97},
        {"effect": "coulomb", "joint": [1], "probability": 0.03}]}
    assert sentence(told, ("a",)).endswith(
        "removes 70 % of the reducible gap. Beside it the model lacks actuator lag at a (97 %).")


def test_what_is_sure_is_no_look_alike():
    def row(name, probability):
        return {"effect": name, "joint": [1], "probability": probability}

    told = {"verdict": "effect", "set_90": ["time_delay", "coulomb", "stribeck"],
            "effects": [row("time_delay", 0.96), row("coulomb", 0.6), row("stribeck", 0.3)],
            "next_experiment": {"best": {"experiment": "chirp"}, "menu": [
                {"experiment": "chirp", "expected_set_size": 2.0, "least_distance": 1e-20}]}}
    section = confusion_section(told)
    assert "tell coulomb and stribeck apart" in section.sentences[0]
    assert "No run" in section.sentences[0] and len(section.tables) == 1
    told["next_experiment"]["menu"][0]["least_distance"] = 40.0
    section = confusion_section(told)
    assert "No run" not in section.sentences[0] and len(section.tables) == 2


@pytest.mark.parametrize("rival, said", [(CONTACT, "step fault or something in the robot's way"),
                                         (SOFT_STOP, "step fault or a soft stop")])
def test_what_outside_the_library_would_move_the_robot_alike_is_told(rival, said):
    likely = {"effect": "step_fault", "joint": [1], "probability": 0.13, "rival": rival}
    told = {"verdict": "unexplained", "set_90": ["unknown", "step_fault"], "effects": [
        {"effect": "unknown", "joint": None, "probability": 0.87}, likely]}
    told["closed_percent"] = {"value": 99.0, "unseen_data": True}
    assert any(point.startswith(said) for point in confusion_section(told).points)
    assert sentence(told, ("a",)).startswith(
        f"These logs cannot tell {FOREIGN[rival]} from step fault at a (13 %)")
    assert f"unexplained: {FOREIGN[rival]} or step_fault at joint 1 (13%)" in line("t", told)
    likely["probability"] = 0.01
    assert not any(point.startswith(said) for point in confusion_section(told).points)
    assert "no effect of the library" in sentence(told, ("a",))


def test_every_rival_has_words():
    assert set(FOREIGN) == set(TOLD_APART) == {CONTACT, SOFT_STOP}
