"""Figures of the scoreboard on studies whose outcome is plain."""

from pathlib import Path

import pytest

from clie_blocks.analysis.blind.main import lines
from clie_blocks.analysis.blind.page import save_page
from clie_blocks.analysis.blind.score import left_out, rate, score

GAP = {"nominal": 4e-4, "true_model": 1e-4, "achievable_reduction": 0.75}
NAMES = {"single": ["coulomb"], "none": ["none"], "unknown": ["soft_stop"],
         "parametric": ["none"], "pair": ["spring", "backlash"]}


def label(kind):
    names = NAMES[kind]
    effects = [{"effect": name, "joints": [1]} for name in names if kind in ("single", "pair")]
    return {"kind": kind, "labels": names, "effects": effects, "severity": "mild", "ratio": 1.5,
            "robot": "arm of 2", "excitations": ["chirp", "steps", "other"], "gap": GAP}


def answer(*names, joint=1, before=4e-4, after=1e-4):
    probability = 0.99 if len(names) == 1 else 0.9
    return {"effects": [{"effect": name, "joint": [joint], "probability": probability}
                        for name in names],
            "set_90": list(names), "unexplained": names == ("unknown",), "verdict": "effect",
            "gap_before": before, "gap_after": after, "seconds": 2.0}


LABELS = {kind: label(kind) for kind in NAMES}
PERFECT = {"single": answer("coulomb"), "none": answer("none"), "unknown": answer("unknown"),
           "parametric": answer("parametric"), "pair": answer("spring", "backlash")}


def test_a_perfect_study_has_full_marks():
    found = score(PERFECT, LABELS)
    full = ("top_1", "top_3", "family", "joint", "effect_and_joint", "all_decisions",
            "parametric_named", "unknown_detected", "pair_recall", "pair_both_in_top_2",
            "set_coverage")
    assert all(found[key]["rate"] == 1 for key in full)
    assert all(found[key]["rate"] == 0 for key in (
        "false_alarm", "false_structure", "unknown_called_none", "false_unknown"))
    assert found["calibration"]["brier"] == pytest.approx(1e-4)
    assert found["shrinkage"]["median"] == pytest.approx(1.0)
    assert found["wrong"] == []


def test_a_study_that_always_says_none_finds_nothing_and_alarms_nobody():
    found = score({kind: answer("none", after=4e-4) for kind in LABELS}, LABELS)
    assert found["top_1"]["rate"] == found["pair_recall"]["rate"] == 0
    assert found["unknown_called_none"]["rate"] == 1 and found["false_alarm"]["rate"] == 0
    assert found["shrinkage"]["median"] == pytest.approx(0.0)
    assert [row["trial"] for row in found["wrong"]] == ["pair", "parametric", "single", "unknown"]


def test_the_wrong_joint_and_the_wrong_friction_count_where_they_should():
    elsewhere = score(PERFECT | {"single": answer("coulomb", joint=2)}, LABELS)
    assert elsewhere["top_1"]["rate"] == 1 and elsewhere["effect_and_joint"]["rate"] == 0
    cousin = score(PERFECT | {"single": answer("stribeck")}, LABELS)
    assert cousin["top_1"]["rate"] == 0 and cousin["family"]["rate"] == 1
    assert cousin["confusion"]["coulomb"] == {"stribeck": 1}


def test_a_diagnosis_that_failed_is_wrong_and_named():
    found = score(PERFECT | {"single": {"error": "too short", "exit_code": 4}}, LABELS)
    assert found["failed"] == ["single"] and found["top_1"]["rate"] == 0


def test_intervals_are_wilsons():
    assert rate([True] * 8 + [False] * 2)["interval"] == pytest.approx([0.4902, 0.9433], abs=1e-4)
    assert rate([])["rate"] is None


def test_page_and_terminal_show_the_headline(tmp_path):
    found = {"seed": 1, **score(PERFECT, LABELS)}
    text = Path(save_page(found, tmp_path)).read_text()
    assert "single effect named right" in text and "<svg" in text and "100 % (1 of 1" in text
    assert any("single effect named right" in line for line in lines(found))


def test_an_effect_taken_out_of_the_library_should_be_unknown(tmp_path):
    found = left_out({"single": answer("unknown")}, LABELS)
    assert found["left_out_unknown"]["rate"] == 1 and found["left_out_none"]["rate"] == 0
    cousin = left_out({"single": answer("stribeck")}, LABELS)
    assert cousin["left_out_family"]["rate"] == 1 and cousin["left_out_unknown"]["rate"] == 0
    page = Path(save_page({"seed": 1, **score(PERFECT, LABELS), **cousin}, tmp_path)).read_text()
    assert "Each effect taken out of the library" in page
