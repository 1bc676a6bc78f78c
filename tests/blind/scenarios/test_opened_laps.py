"""Robots of opened laps, of the catalogue and of arms in space, that were called another name."""

import pytest

from clie_blocks.analysis.blind.population.arms_in_space import ARMS_IN_SPACE
from clie_blocks.analysis.blind.population.catalogue import WHOLE_CATALOGUE
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap import diagnose, read

SAME = {  # number of the answer, and of the robot
    "rest_time_breakaway": {"velocity": "rest_speed", "slip": "rest_slide"},
    "stribeck": {"level": "level", "velocity": "stribeck"},
    "torque_quantization": {"resolution": "quantum"},
}


@pytest.mark.slow
@pytest.mark.parametrize("seed, index, name", [
    (22469, 16, "rest_time_breakaway"), (34141, 24, "stribeck"),
    (34141, 39, "encoder_quantization"), (34141, 61, "torque_quantization"),
    (68903, 87, "supply_sag"), (83117, 1, "joint_elasticity")])
def test_a_robot_that_was_missed_is_named_with_its_numbers(seed, index, name, tmp_path):
    made = make_trial(WHOLE_CATALOGUE, seed, index)
    (truth,) = made.label["effects"]
    write_trial(made, tmp_path / "trial")
    found = diagnose(read(tmp_path / "trial"))
    assert found.to_dict()["set_90"] == [truth["effect"]] == [name]
    for answered, true in SAME.get(name, {}).items():
        (setting,) = found.effects()
        (joint,) = truth["joints"]
        assert setting.values[answered][joint - 1] == pytest.approx(
            truth["numbers"][true][joint - 1], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("index, name", [
    (50, "velocity_filter_mismatch"), (90, "torque_gain_error")])
def test_an_arm_whose_effect_was_missed_has_it_named_at_its_joint(index, name, tmp_path):
    made = make_trial(ARMS_IN_SPACE, 74687, index)
    (truth,) = made.label["effects"]
    write_trial(made, tmp_path / "trial")
    answer = diagnose(read(tmp_path / "trial")).to_dict()
    assert answer["set_90"] == [truth["effect"]] == [name]
    assert answer["effects"][0]["joint"] == truth["joints"]
