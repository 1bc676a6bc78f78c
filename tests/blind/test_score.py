"""Figures of the scoreboard on studies whose outcome is plain."""

from pathlib import Path

import pytest

from clie_blocks.analysis.blind.command import lines
from clie_blocks.analysis.blind.comparison.leave_one_out import chosen, scored
from clie_blocks.analysis.blind.protocol import seeds
from clie_blocks.analysis.blind.protocol.targets import judged
from clie_blocks.analysis.blind.report.page import save_page
from clie_blocks.analysis.blind.scoring.intervals import figure, rate
from clie_blocks.analysis.blind.scoring.score import calibration_error, score

GAP = {"nominal": 4e-4, "true_model": 1e-4, "achievable_reduction": 0.75}
NAMES = {"single": ["coulomb"], "none": ["none"], "unknown": ["soft_stop"],
         "parametric": ["none"], "pair": ["spring", "backlash"],
         "triple": ["spring", "backlash", "coulomb"]}


def label(kind):
    names = NAMES[kind]
    effects = [{"effect": name, "joints": [1]} for name in names
               if kind in ("single", "pair", "triple")]
    return {"kind": kind, "labels": names, "effects": effects, "severity": "mild", "ratio": 1.5,
            "robot": "arm of 2", "gear_ratios": [60.0, 80.0],
            "excitations": ["chirp", "steps", "other"], "gap": GAP}


def answer(*names, joint=1, before=4e-4, after=1e-4):
    probability = 0.99 if len(names) == 1 else 0.9
    return {"effects": [{"effect": name, "joint": [joint], "probability": probability}
                        for name in names],
            "set_90": list(names), "unexplained": names == ("unknown",), "verdict": "effect",
            "gap_before": before, "gap_after": after, "seconds": 2.0}


LABELS = {kind: label(kind) for kind in NAMES}
PERFECT = {"single": answer("coulomb"), "none": answer("none"), "unknown": answer("unknown"),
           "parametric": answer("parametric"), "pair": answer("spring", "backlash"),
           "triple": answer("spring", "backlash", "coulomb")}


def board(found):
    """Scoreboard as `clie blind` completes it."""
    return {"seeds": [1], **found, "targets": judged(found)}


def test_a_perfect_study_has_full_marks():
    found = score(PERFECT, LABELS)
    full = ("top_1", "top_3", "family", "joint", "effect_and_joint", "all_decisions",
            "parametric_named", "unknown_detected", "pair_recall", "pair_all_in_top_2",
            "triple_recall", "triple_all_in_top_3", "set_coverage_all")
    assert all(found[key]["rate"] == 1 for key in full)
    assert all(found[key]["rate"] == 0 for key in (
        "false_alarm", "false_structure", "unknown_called_none", "false_unknown"))
    assert found["calibration"]["brier"]["value"] == pytest.approx(1e-4)
    assert found["shrinkage"]["median"] == found["against_true_model"]["median"] == 1.0
    assert found["by_gear"]["above 50"]["of"] == 1
    assert found["wrong"] == []


def test_a_study_that_always_says_none_finds_nothing_and_alarms_nobody():
    found = score({kind: answer("none", after=4e-4) for kind in LABELS}, LABELS)
    assert found["top_1"]["rate"] == found["pair_recall"]["rate"] == 0
    assert found["unknown_called_none"]["rate"] == 1 and found["false_alarm"]["rate"] == 0
    assert found["shrinkage"]["median"] == pytest.approx(0.0)
    assert [row["trial"] for row in found["wrong"]] == ["pair", "parametric", "single", "triple",
                                                     "unknown"]


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


def test_a_figure_is_drawn_from_its_own_rows():
    found = figure(range(101), max)
    assert found["value"] == 100 and 90 < found["interval"][0] <= found["interval"][1] == 100
    sure = [(0.9, True)] * 9 + [(0.9, False)]
    assert calibration_error(sure) == pytest.approx(0.0)
    assert calibration_error([(0.9, False)] * 4) == pytest.approx(0.9)


def test_a_target_is_reached_not_shown_or_missed():
    found = {row["key"]: row["reached"] for row in judged(score(PERFECT, LABELS))}
    assert set(found.values()) == {"yes"} and len(found) == 11
    wrong = PERFECT | {"single": answer("stribeck"), "none": answer("spring")}
    many = {f"{kind}-{i}": one for kind, one in LABELS.items() for i in range(40)}
    poor = score({name: wrong[name.partition("-")[0]] for name in many}, many)
    found = {row["key"]: row["reached"] for row in judged(poor)}
    assert found["top_1_mild"] == found["false_alarm"] == "no"
    few = {row["key"]: row["reached"] for row in judged(score(wrong, LABELS))}
    assert few["top_1_mild"] == "not shown" or few["top_1_mild"] == "no"


def test_page_and_terminal_show_the_headline(tmp_path):
    found = board(score(PERFECT, LABELS))
    text = Path(save_page(found, tmp_path)).read_text()
    assert "single effect named right" in text and "<svg" in text and "1 of 1" in text
    assert "Target and measured" in text and len(text) < 2_000_000
    assert any("single effect named right" in line for line in lines(found))


def test_an_effect_taken_out_of_the_library_should_be_unknown(tmp_path):
    found = scored({"single": answer("unknown")}, LABELS)
    assert found["left_out_unknown"]["rate"] == 1 and found["left_out_none"]["rate"] == 0
    cousin = scored({"single": answer("stribeck")}, LABELS)
    assert cousin["left_out_family"]["rate"] == 1 and cousin["left_out_unknown"]["rate"] == 0
    page = Path(save_page(board(score(PERFECT, LABELS)) | cousin, tmp_path)).read_text()
    assert "Each effect taken out of the library" in page


def test_effects_are_left_out_evenly_over_the_seeds():
    labels = {seed: {f"{effect}-{i}": label("single") | {"labels": [effect]}
                     for effect in ("coulomb", "spring", "encoder_quantization") for i in range(3)}
              for seed in (51, 52, 53)}
    found = chosen(labels, 2)
    assert found == {"coulomb": [(51, "coulomb-0"), (52, "coulomb-0")],
                     "spring": [(52, "spring-0"), (53, "spring-0")]}
    assert [len(trials) for trials in chosen(labels).values()] == [9, 9]


def test_what_is_reported_was_not_learned_from(tmp_path, monkeypatch):
    told = {"robots": 60, "seed": 1, "trials": 200, "seeds": [41, 42]}
    monkeypatch.setattr(seeds, "_told", lambda: told)
    assert seeds.disjoint([40, 81]) and not seeds.disjoint([81, 42])
    assert not seeds.disjoint([81, 75]) and not seeds.disjoint([81, 3000])
    assert [row[1:] for row in seeds.taught()[1:]] == [
        ("own_robots", "60", "1"), ("MuJoCo", "200", "41, 42")]
    for seed, proof in ((81, True), (42, False), (3000, False)):
        page = Path(save_page(board(score(PERFECT, LABELS)) | {"seeds": [seed]}, tmp_path))
        assert ("the figures are no proof" in page.read_text()) is not proof


def test_the_calibration_names_the_seeds_that_it_learned_from():
    assert {row[1] for row in seeds.taught()} <= {"MuJoCo", "own_robots"}
    assert not set(seeds.learned()) & set(range(51, 66))
