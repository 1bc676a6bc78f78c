"""The command: folders of trials, results on disk, a later run that continues, errors in words."""

import json

import pytest

from clie_blocks.analysis.gap import batch
from clie_blocks.analysis.gap.command import main
from clie_blocks.analysis.gap.report.summary import summary_line
from clie_blocks.output import guarded


@pytest.fixture(scope="module")
def folder(tmp_path_factory, case, write_trial):
    place = tmp_path_factory.mktemp("set")
    write_trial(case("none", seed=3), place / "trial-1")
    return place


def test_a_set_is_diagnosed_kept_and_read_back(folder, tmp_path, capsys):
    out = tmp_path / "all.json"
    assert main([str(folder), "--json", str(out), "--all", "-o", str(tmp_path / "kept")]) == 0
    told = json.loads(out.read_text())
    assert told["trial-1"]["verdict"] == "none"
    assert "trial-1: none" in capsys.readouterr().out
    kept = tmp_path / "kept" / "trial-1.json"
    marked = json.loads(kept.read_text())
    kept.write_text(json.dumps({**marked, "seconds": -1.0}))
    (again,) = batch.diagnose_all(batch.find_tasks([folder]), folder=kept.parent)
    assert again[1]["seconds"] == -1.0
    kept.write_text("{broken")
    (again,) = batch.diagnose_all(batch.find_tasks([folder]), folder=kept.parent)
    assert again[1]["seconds"] > 0.0


def test_errors_are_words(tmp_path, folder, capsys):
    assert guarded(main, [str(tmp_path / "nothing")]) == 3
    assert "does not exist" in capsys.readouterr().err
    assert guarded(main, [str(tmp_path)]) == 3
    assert "robot.toml" in capsys.readouterr().err
    assert guarded(main, [str(folder), "--effects", "stribek"]) == 2
    assert "stribeck" in capsys.readouterr().err
    assert guarded(main, [str(folder), "--holdout", "log-9"]) == 3
    assert "log-9" in capsys.readouterr().err


def test_a_sentence_says_cause_joint_and_what_it_buys():
    told = {"verdict": "effect", "effects": [
        {"effect": "coulomb", "joint": [1, 2], "probability": 0.93},
        {"effect": "stribeck", "joint": [1], "probability": 0.05}],
        "closed_percent": {"value": 96.4, "unseen_data": True}}
    assert summary_line("arm", told) == ("arm: effect: coulomb at joint 1 and 2 (93%); closes 96 % "
                                     "of the reducible gap on unseen data")
    unsure = {"verdict": "not_identifiable", "set_90": ["coulomb", "stribeck"]}
    assert summary_line("arm", {**told, **unsure}).startswith(
        "arm: not_identifiable: coulomb or stribeck; closes 96 %")
    family = {"families": {"friction": 0.7}, "effects": [
        {"effect": "coulomb", "joint": [1], "probability": 0.4}]}
    assert "not_identifiable: friction of some kind (70%), most likely coulomb at joint 1 (40%);" \
        in summary_line("arm", {**told, **unsure, **family})
    one_of_many = {"families": {"friction": 0.95}, "effects": [
        {"effect": "coulomb", "joint": [1], "probability": 0.6}]}
    assert "effect: coulomb at joint 1 (60%; friction of some kind 95%);" in summary_line(
        "arm", {**told, **one_of_many})
    fitted = {"closed_percent": {"value": 96.4, "unseen_data": False}}
    assert summary_line("arm", {**told, **fitted}).endswith("gap on the data that it was fitted to")
    assert "; the nearest closes 96 %" in summary_line("arm", {**told, "verdict": "unexplained"})
    wrong = {"verdict": "parametric", "noise": [{}], "joint_model": {"inertia": {
        "value": [0.05], "stated": [0.04], "tolerance": [4e-4], "unit": "kg m^2"}}}
    assert summary_line("arm", {**told, **wrong}) == (
        "arm: parametric: inertia at joint 1 0.05 kg m^2, stated 0.04")
    rest = {"beside": ["coulomb"], "percent": 31.5}
    assert summary_line("arm", {**told, "repeatable": rest}).endswith(
        "unseen data; a torque table over place and speed beside coulomb removes 32 % of what "
        "that leaves")
    assert "beside the refitted model removes" in summary_line(
        "arm", {**told, "repeatable": {**rest, "beside": []}})
