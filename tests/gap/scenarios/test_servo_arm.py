"""A desk arm of hobby servos as its owner has it: a robot of the gallery, logs of positions."""

import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis import cli  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.records import read_trial  # noqa: E402
from tests.scripts import script  # noqa: E402

pytestmark = pytest.mark.slow
SECONDS = "600"  # of a budget that no machine of the tests reaches
SUSPECTS = "coulomb,spring,backlash,payload,time_delay"
ARM = script("example_servo_arm")


def folder_of(path, **how):
    """Folder with the robot file of the gallery, as it is written, and logs of the arm."""
    assert cli.main(["robot", "so101", "-o", str(path)]) == 0
    ARM.ServoArm(**how).write_logs(path)
    return path


def answer_of(path, *options, **how):
    """Answer of `clie diagnose` on such a folder."""
    folder = folder_of(path / "arm", **how)
    assert cli.main(["diagnose", str(folder), "-o", str(path / "out"),
                     "--seconds", SECONDS, *options]) == 0
    return json.loads((path / "out" / "arm.json").read_text())


def test_the_links_show_the_gain_of_each_servo_that_carries_some(tmp_path):
    robot, records = read_trial(folder_of(tmp_path))
    problem = Problem.from_logs(robot, records)
    np.testing.assert_allclose(problem.law.kp[:3], ARM.STIFFNESS[:3], rtol=0.1)
    assert problem.links.has_gravity and problem.links.has_coupling


@pytest.mark.parametrize("is_sent", [True, False], ids=["sent", "made by the servos"])
def test_a_sound_arm_has_no_gap_however_it_gets_its_set_points(tmp_path, is_sent):
    answer = answer_of(tmp_path, is_sent=is_sent)
    assert answer["verdict"] == "none"
    said = " ".join(answer["log_decisions"])
    assert ("held from row to row" in said) == is_sent
    assert "by the links of the robot file" in said


def test_the_elbow_that_rubs_is_named(tmp_path):
    answer = answer_of(tmp_path, "--effects", SUSPECTS, friction={ARM.ELBOW: ARM.FRICTION})
    first = answer["effects"][0]
    assert (first["effect"], first["joint"]) == ("coulomb", [ARM.ELBOW + 1])
    assert first["probability"] > 0.5
    level, = first["parameters"]["level"]["value"]
    assert level == pytest.approx(ARM.FRICTION, rel=0.2)  # N m
    assert [row for row in answer["effects"][1:] if row["probability"] >= 0.5] == []
