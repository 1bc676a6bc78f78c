"""Robots of another engine whose law carries the weight of the links, stated or not."""

import functools
import re

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.standard import draw_trial  # noqa: E402
from clie_blocks.analysis.gap.batch import read  # noqa: E402
from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.controller.terms import REMEDY, WEIGHT  # noqa: E402
from clie_blocks.analysis.gap.diagnosis import diagnose  # noqa: E402


@functools.cache
def drawn(effects, masses, seed):
    """Trial of an arm of two links whose law adds their weight, of masses times some factors."""
    def wrong(rng, robot, truth):
        return {**truth, "carried_links": np.array(masses)}

    made = draw_trial(np.random.default_rng(seed), 0, "parametric", effects,
                      "medium" if effects else None, "arm", wrong=wrong)
    assert made.robot.n == 2 and made.robot.gravity
    return made


@pytest.fixture
def arm(tmp_path):
    """Function that writes such an arm into the folder, and changes lines of its file."""
    def make(effects=(), masses=(1.0, 1.0), stated=True, seed=31):
        made = drawn(effects, masses, seed)
        write_trial(made, tmp_path)
        if stated:
            change("[controller]", '[controller]\ncompensation = "gravity"')
        return made

    def change(old, new):
        file = tmp_path / "robot.toml"
        file.write_text(file.read_text().replace(old, new))

    make.change = change
    return make


def shares(found):
    return {one.joint: one.coefficients[WEIGHT] for one in found.controller.terms}


@pytest.mark.slow
def test_a_sound_arm_whose_law_carries_it_is_sound(arm, tmp_path):
    arm()
    found = diagnose(read(tmp_path))
    assert found.verdict == "none" and found.controller.as_stated


@pytest.mark.slow
@pytest.mark.parametrize("masses", [(1.0, 1.0), (0.7, 0.7)])
def test_a_law_that_carries_the_links_unasked_is_named_and_accuses_no_joint(arm, tmp_path, capsys,
                                                                            masses):
    arm(masses=masses, stated=False)
    assert main([str(tmp_path), "-o", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())  # lines are wrapped
    assert "agrees with the robot down to the sensor noise" in said
    assert f"it contains {masses[0]:g} times the weight of the links at" in said
    assert REMEDY in said
    found = diagnose(read(tmp_path))
    assert found.verdict == "none" and not found.controller.as_stated
    assert shares(found) == {k: pytest.approx(masses[0], rel=1e-3) for k in (0, 1)}


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, False])
def test_links_of_other_masses_in_the_law_hide_no_friction(arm, tmp_path, stated):
    made = arm(("coulomb",), masses=(0.6, 1.2), stated=stated)
    found = diagnose(read(tmp_path))
    assert not found.controller.as_stated and not found.controller.unexplained
    rows = [row for row in found.to_dict()["effects"]
            if row["effect"] in ("coulomb", "asymmetric_coulomb")]
    assert rows[0] == found.to_dict()["effects"][0]
    assert rows[0]["joint"] == made.label["effects"][0]["joints"]
    assert sum(row["probability"] for row in rows) > 0.85


@pytest.mark.slow
def test_a_compensation_that_did_not_run_is_found(arm, tmp_path):
    arm(masses=(0.0, 0.0))
    found = diagnose(read(tmp_path))
    assert found.verdict == "none" and found.controller.misdescribed
    ran = {one.joint: one.value for one in found.controller.parameters
           if one.name == "compensation"}
    assert ran == {k: pytest.approx(0.0, abs=1e-2) for k in (0, 1)}


@pytest.mark.parametrize(("old", "new", "said"), [
    ("mass_kg", "# mass_kg", r"states none: state \[links\]"),
    ("gravity = true", "gravity = false", r"state gravity = true there")])
def test_a_weight_that_no_one_states_cannot_be_carried(arm, tmp_path, capsys, old, new, said):
    arm()
    arm.change(old, new)
    assert main([str(tmp_path), "--quiet"]) == 4
    error = capsys.readouterr().err
    assert re.search(said, " ".join(error.split()))
