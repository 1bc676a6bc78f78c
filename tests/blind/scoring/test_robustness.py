"""Outcomes of robots that their file does not describe."""

import pytest

from clie_blocks.analysis.blind.population.wrong_controller import MISSTATEMENTS
from clie_blocks.analysis.blind.scoring import robustness
from clie_blocks.analysis.blind.scoring.robustness import CONTROLLER, outcome


def answer(*effects, decisions=()):
    return {"effects": [{"effect": name, "joint": [1], "probability": 0.9} for name in effects],
            "set_90": list(effects), "unexplained": effects == ("unknown",),
            "decisions": list(decisions), "gap_before": 1e-3, "gap_after": 1e-3, "seconds": 1.0}


@pytest.mark.parametrize(("diagnosis", "expected"), [
    (answer("velocity_filter_mismatch"), "named"),
    (answer("none", decisions=["the filter runs as 'zoh'"]), "named"),
    (answer("unknown"), "unknown"), (answer("parametric"), "missed"), (answer("none"), "missed"),
    (answer("time_delay", decisions=["anything"]), "accused"),
    ({"error": "too short", "exit_code": 4}, "failed")])
def test_an_outcome_is_named_unknown_missed_or_a_false_attribution(diagnosis, expected):
    assert outcome(diagnosis, [CONTROLLER]) == expected


def test_words_of_the_controller_check_name_no_effect_of_the_robot():
    diagnosis = answer("unknown", decisions=["the filter runs as 'zoh'"])
    assert outcome(diagnosis, ["coulomb"]) == "unknown"
    assert outcome(diagnosis, [CONTROLLER]) == "named"
    assert outcome(answer("coulomb"), ["coulomb"]) == "named"
    assert outcome(answer("coulomb"), []) == "accused"


def test_the_scores_are_shares_by_what_is_wrong():
    labels = {f"trial-{i:03d}": {"labels": [name], "wrong": "x 1.1", "robot": "arm of 2",
                                  "present": [CONTROLLER]}
              for i, name in enumerate(MISSTATEMENTS)}
    found = robustness.score_misdescribed(
        {name: answer("unknown" if i else "spring") for i, name in enumerate(labels)}, labels)
    assert found["accused"]["hits"] == 1 and found["unknown"]["hits"] == len(MISSTATEMENTS) - 1
    assert found["by_hidden"][next(iter(MISSTATEMENTS))]["accused"]["rate"] == 1.0
