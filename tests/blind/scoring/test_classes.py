"""Names that no log tells apart: one class, right for any of its members."""

import pytest

from clie_blocks.analysis.blind.protocol.targets import CATALOGUE_TARGETS, compare_with_targets
from clie_blocks.analysis.blind.scoring.by_name import score_by_name
from clie_blocks.analysis.blind.scoring.classes import as_classes
from clie_blocks.analysis.blind.scoring.score import score

CLASSES = {"dahl": "presliding", "back_emf": "parametric"}


def class_of(name):
    return CLASSES.get(name, name)


@pytest.fixture
def dahl(plain_study):
    label = plain_study.label("single") | {
        "labels": ["dahl"], "effects": [{"effect": "dahl", "joints": [1]}]}
    return {"one": label}


def test_a_member_of_the_class_is_right(plain_study, dahl):
    answers = {"one": plain_study.answer("presliding")}
    names, classes = score(answers, dahl), score(answers, dahl, class_of)
    assert names["top_1"]["rate"] == 0 and names["family"]["rate"] == 1
    assert classes["top_1"]["rate"] == classes["joint"]["rate"] == 1
    assert classes["by_effect"]["dahl"]["hits"] == 1
    assert classes["confusion"] == {"presliding": {"presliding": 1}}


def test_the_90_percent_set_is_counted_in_classes(plain_study, dahl):
    both = plain_study.answer("presliding", "dahl", "coulomb")
    assert score({"one": both}, dahl)["set_size"]["value"] == 3
    assert score({"one": both}, dahl, class_of)["set_size"]["value"] == 2
    merged = as_classes(both, class_of)
    assert merged["effects"][0]["probability"] == pytest.approx(1.8)
    assert as_classes({"error": "too short"}, class_of) == {"error": "too short"}


def test_an_effect_that_only_parameters_show_is_right_as_parametric(plain_study):
    label = plain_study.label("single") | {
        "labels": ["back_emf"], "effects": [{"effect": "back_emf", "joints": [2]}]}
    board = score({"one": plain_study.answer("parametric")}, {"one": label}, class_of)
    assert board["top_1"]["rate"] == board["top_3"]["rate"] == 1 and board["joint"]["of"] == 0


def test_a_known_effect_called_by_a_new_name_is_counted(plain_study):
    labels = {kind: plain_study.label("single") for kind in ("new", "old", "right")}
    answers = {"new": plain_study.answer("dahl"), "old": plain_study.answer("stribeck"),
               "right": plain_study.answer("coulomb")}
    assert score(answers, labels)["newcomer_named"]["hits"] == 1
    assert score(answers, labels, class_of)["newcomer_named"]["hits"] == 0  # presliding is old


def test_every_name_has_a_row_with_what_it_was_taken_for(plain_study, dahl):
    labels = dahl | {"two": dahl["one"], "out": plain_study.label("unknown")}
    answers = {"one": plain_study.answer("presliding"), "two": plain_study.answer("coulomb"),
               "out": plain_study.answer("spring")}
    rows = score_by_name(answers, labels, class_of)
    assert list(rows) == ["dahl", "random_torque"]
    assert rows["dahl"]["class"] == "presliding" and rows["dahl"]["right"]["hits"] == 1
    assert rows["dahl"]["wrong"] == {"coulomb": 1}
    foreign = rows["random_torque"]
    assert foreign["class"] == "unknown" and foreign["right"]["hits"] == 0


def test_targets_of_the_catalogue_are_compared_over_classes(plain_study, dahl):
    board = score({"one": plain_study.answer("presliding")}, dahl, class_of)
    rows = {row["key"]: row for row in compare_with_targets(board, CATALOGUE_TARGETS)}
    assert rows["top_1"]["reached"] == "yes" and rows["top_1"]["target"] == 0.90


def test_names_that_the_logs_do_not_tell_apart_are_one_answer(plain_study):
    label = plain_study.label("single") | {
        "labels": ["gravity"], "effects": [{"effect": "gravity", "joints": [1]}]}
    said = plain_study.answer("spring", "gravity")
    for row in said["effects"]:
        row["alike"] = [{"spring": "gravity", "gravity": "spring"}[row["effect"]]]
    board = score({"one": said}, {"one": label})
    assert board["top_1"]["rate"] == board["joint"]["rate"] == 1
    assert board["set_size"]["value"] == 1


@pytest.mark.parametrize("of", [str, class_of])
def test_the_effect_of_a_wrong_number_is_right_under_its_name(plain_study, of):
    label = plain_study.label("parametric") | {"labels": ["torque_gain"], "effects": []}
    board = score({"one": plain_study.answer("torque_gain_error")}, {"one": label}, of)
    assert board["parametric_named"]["rate"] == board["set_coverage"]["rate"] == 1
    other = score({"one": plain_study.answer("coulomb")}, {"one": label}, of)
    assert other["parametric_named"]["rate"] == other["set_coverage"]["rate"] == 0


def test_an_effect_that_was_corrected_in_the_logs_is_an_answer(plain_study):
    label = plain_study.label("single") | {
        "labels": ["channel_skew"], "effects": [{"effect": "channel_skew", "joints": [2]}]}
    late = {"effect": "channel_skew", "joint": [2], "what": "late"}
    answer = plain_study.answer("none") | {"log": {"corrections": [late]}}
    board = score({"one": answer}, {"one": label}, class_of)
    assert board["top_1"]["rate"] == board["joint"]["rate"] == 1
    without = plain_study.answer("none") | {"log": {"corrections": [late | {"effect": ""}]}}
    assert score({"one": without}, {"one": label}, class_of)["top_1"]["rate"] == 0


def test_an_outsider_that_the_catalogue_holds_by_now_is_known(plain_study):
    def label(name, robot):
        return plain_study.label("unknown") | {
            "labels": [name], "robot": robot, "effects": [{"effect": name, "joints": [1]}]}

    labels = {"gains": label("gain_scaling", "arm of 2"), "wall": label("wall", "pendulum of 1"),
              "arm": label("wall", "arm of 2")}
    answers = {name: plain_study.answer(said) for name, said in
               (("gains", "gain_error"), ("wall", "soft_stop"), ("arm", "unknown"))}
    board = score(answers, labels)
    assert (board["top_1"]["hits"], board["top_1"]["of"]) == (2, 2)
    assert (board["unknown_detected"]["hits"], board["unknown_detected"]["of"]) == (1, 1)
