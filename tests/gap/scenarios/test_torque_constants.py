"""Currents of two coupled joints in MuJoCo, whose torque constants are off."""

import dataclasses
import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis import cli  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.trials import draw_trial, write_trial  # noqa: E402

pytestmark = pytest.mark.slow
SEED, SOUND = 7771, 79  # of the seeds of the development; currents of a sound arm at 5 kHz


def answer_of(folder, constant):
    """Answer on an arm whose torque per current is so many times what its file states."""
    trial = dataclasses.replace(draw_trial(SEED, SOUND), constant=np.array(constant))
    assert trial.label["content"] == "current" and trial.label["joints"] == 2
    (folder / "arm").mkdir()
    write_trial(trial, folder / "arm")
    assert cli.main(["diagnose", str(folder / "arm"), "-o", str(folder / "out")]) == 0
    return json.loads((folder / "out" / "arm.json").read_text())


def test_constants_within_their_tolerance_are_found_and_no_gap(tmp_path):
    answer = answer_of(tmp_path, [0.94, 1.07])
    assert answer["verdict"] == "none" and answer["simulator"] == []
    torque = answer["joint_model"]["torque"]
    np.testing.assert_allclose(torque["value"], [0.94, 1.07], rtol=0.02)
    assert torque["tolerance"] == [0.1, 0.1]


def test_a_constant_beyond_its_tolerance_is_a_number_of_the_file(tmp_path):
    answer = answer_of(tmp_path, [1.0, 1.4])
    assert answer["verdict"] == "parametric"
    row, = answer["description"]
    assert (row["key"], row["joint"]) == ("motor.torque_constant_nm_a", 2)
    assert row["identified"] == pytest.approx(1.4, rel=0.05) and row["stated"] == 1.0
    assert row["effects"] == ["torque_gain_error"]
