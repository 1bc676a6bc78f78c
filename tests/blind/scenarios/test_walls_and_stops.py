"""Walls and a soft stop of the other engine: what a wall is called, and where a stop stands."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.standard import STANDARD
from clie_blocks.analysis.gap import diagnose, read


def write_wall(folder, seed, index):
    """Write a trial of the other engine whose tip touches a wall; returns its positions."""
    made = make_trial(STANDARD, seed, index)
    assert made.label["effects"][0]["effect"] == "wall"
    write_trial(made, folder)
    return np.concatenate([record.q for record in read(folder).records])


@pytest.mark.slow
def test_a_wall_in_the_way_of_an_arm_keeps_unknown_in_the_set(tmp_path):
    write_wall(tmp_path / "trial", 74, 38)
    answer = diagnose(read(tmp_path / "trial")).to_dict()
    assert answer["verdict"] == "unexplained"
    first = answer["effects"][0]
    assert first["effect"] == "unknown" in answer["set_90"]
    assert first["probability"] > 0.5


@pytest.mark.slow
def test_a_wall_in_the_way_of_a_single_link_is_a_stop_where_it_stands(tmp_path):
    positions = write_wall(tmp_path / "trial", 72, 49)
    found = diagnose(read(tmp_path / "trial"))
    assert found.to_dict()["set_90"] == ["soft_stop"]
    (setting,) = found.effects()
    assert setting.values["upper"] == pytest.approx(positions.max(), abs=0.01)


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
