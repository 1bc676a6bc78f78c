"""Targets: reached, not shown, or missed."""

from clie_blocks.analysis.blind.protocol.targets import compare_with_targets
from clie_blocks.analysis.blind.scoring.score import score


def reached(answers, labels):
    return {row["key"]: row["reached"] for row in compare_with_targets(score(answers, labels))}


def test_a_target_is_reached_not_shown_or_missed(plain_study):
    right = plain_study.right_answers
    everything = reached(right, plain_study.labels)
    assert set(everything.values()) == {"yes"} and len(everything) == 11
    wrong = right | {"single": plain_study.answer("stribeck"),
                     "none": plain_study.answer("spring")}
    many = {f"{kind}-{i}": label for kind, label in plain_study.labels.items() for i in range(40)}
    nothing = reached({name: wrong[name.partition("-")[0]] for name in many}, many)
    assert nothing["top_1_mild"] == nothing["false_alarm"] == "no"
    labels = plain_study.labels | {"other": plain_study.label("single")}
    half = reached(wrong | {"other": right["single"]}, labels)
    assert half["top_1_mild"] == "not shown"  # one of two, whose interval reaches 0.9
