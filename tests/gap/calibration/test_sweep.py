"""Sweeps: trials with a known truth, diagnosed with one threshold at several values."""

import json

import pytest

from clie_blocks.analysis.gap.calibration.sweep import (
    Outcome,
    find_threshold,
    main,
    read_value,
    sweep,
)
from clie_blocks.errors import ClieError, RecordError


@pytest.fixture(scope="module")
def trials(case, write_trial, tmp_path_factory):
    """Folder of one labelled trial: a healthy robot."""
    folder = tmp_path_factory.mktemp("trials")
    write_trial(case("none"), folder / "trial-000")
    (folder / "labels.json").write_text(json.dumps(
        {"trial-000": {"kind": "none", "labels": ["none"]}}))
    return folder


def test_each_value_is_diagnosed_with_and_counted(trials):
    outcomes = sweep("calibration.healthy", [0.5, 1e-9], trials)
    usual, strict = outcomes[0.5], outcomes[1e-9]
    assert (usual.trials, usual.right, usual.sound, usual.alarms) == (1, 1, 1, 0)
    assert usual.set_size == 1.0 and usual.seconds > 0.0
    assert strict.trials == 1


def test_the_command_prints_a_row_per_value_and_what_the_threshold_is(trials, capsys):
    assert main(["verdict.certain", "0.97", "--trials", str(trials)]) == 0
    first, head, row = capsys.readouterr().out.splitlines()
    assert first.startswith("verdict.certain [probability]: ") and first.endswith("now 0.97")
    assert head.split("  ")[0] == "value" and row.startswith("0.97") and "1 of 1" in row
    assert main(["verdict.certain", "0.97", "--trials", str(trials), "--json"]) == 0
    (outcome,) = json.loads(capsys.readouterr().out)["outcomes"]
    assert outcome["value"] == 0.97 and outcome["right"] == 1


def test_an_outcome_counts_what_is_right_first_the_sets_and_false_alarms():
    labels = {"a": {"kind": "pair", "labels": ["spring", "coulomb"]},
              "b": {"kind": "none", "labels": ["none"]},
              "c": {"kind": "unknown", "labels": ["dahl"]}}

    def answer(first, verdict, names):
        return {"effects": [{"effect": first}], "verdict": verdict, "seconds": 2.0,
                "set_90": names}

    answers = {"a": answer("coulomb", "effect", ["coulomb", "spring"]),
               "b": answer("backlash", "effect", ["backlash"]),
               "c": answer("unknown", "unexplained", ["unknown", "spring", "gravity"])}
    outcome = Outcome.of(answers, labels)
    assert outcome == Outcome(trials=3, right=2, set_size=2.0, sound=1, alarms=1, seconds=6.0)
    assert outcome.cells() == ("2 of 3", "2.00", "1 of 1", "6.0")


def test_an_unknown_threshold_gets_the_nearest_name():
    with pytest.raises(ClieError, match="no threshold is called 'search.leader'; did you mean "
                                        "'search.leaders'"):
        find_threshold("search.leader")


@pytest.mark.parametrize("name, text, value", [
    ("search.leaders", "12", 12), ("calibration.healthy", "1", 1.0),
    ("assessment.map_ridges", "(0.1, 1.0)", (0.1, 1.0))])
def test_a_value_is_read_as_the_threshold_takes_it(name, text, value):
    read = read_value(text, find_threshold(name))
    assert read == value and type(read) is type(value)


@pytest.mark.parametrize("name, text", [
    ("search.leaders", "4.5"), ("search.leaders", "many"), ("calibration.healthy", "(1, 2)"),
    ("calibration.healthy", "True"), ("assessment.map_ridges", "0.1")])
def test_a_value_of_another_kind_is_refused(name, text):
    with pytest.raises(ClieError, match="is no value of"):
        read_value(text, find_threshold(name))


def test_a_trial_without_its_truth_is_refused(trials, tmp_path):
    with pytest.raises(RecordError, match="does not exist: name the file .* --labels"):
        sweep("search.leaders", [8], trials, tmp_path / "labels.json")
    (tmp_path / "labels.json").write_text("{}")
    with pytest.raises(RecordError, match="no label for trial-000"):
        sweep("search.leaders", [8], trials, tmp_path / "labels.json")
