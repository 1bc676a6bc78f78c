"""Walls and a soft stop of the other engine: where a name fits a wall, `unknown` stands by it."""

import pytest

from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.standard import STANDARD
from clie_blocks.analysis.gap import diagnose, read


@pytest.mark.slow
@pytest.mark.parametrize("seed, index, foreign, alike", [
    (72, 49, "wall", {"step_fault"}), (74, 38, "wall", {"step_fault"})])
def test_what_is_foreign_and_moves_the_robot_like_a_cause_keeps_unknown_in_the_set(
        tmp_path, seed, index, foreign, alike):
    made = make_trial(STANDARD, seed, index)
    assert made.label["effects"][0]["effect"] == foreign
    write_trial(made, tmp_path / "trial")
    answer = diagnose(read(tmp_path / "trial")).to_dict()
    assert answer["verdict"] == "unexplained"
    assert {"unknown", *alike} <= set(answer["set_90"])


@pytest.mark.slow
def test_a_soft_stop_is_named_with_its_place(tmp_path):
    made = make_trial(STANDARD, 71, 71)
    (truth,) = made.label["effects"]
    write_trial(made, tmp_path / "trial")
    found = diagnose(read(tmp_path / "trial"))
    assert found.to_dict()["set_90"] == [truth["effect"]] == ["soft_stop"]
    (setting,) = found.effects()
    for name, true in (("stiffness", "stop_stiffness"), ("upper", "stop")):
        assert setting.values[name] == pytest.approx(truth["numbers"][true], rel=0.01)


@pytest.mark.slow
def test_a_fault_that_truly_sets_in_has_no_rival(tmp_path):
    made = make_trial(STANDARD, 75, 61)
    write_trial(made, tmp_path / "trial")
    answer = diagnose(read(tmp_path / "trial")).to_dict()
    assert answer["effects"][0] == {**answer["effects"][0], "effect": "step_fault", "rival": ""}
    assert answer["effects"][0]["probability"] > 0.95
