"""An installed package has logs to try, right ones, and never writes them over a user's files."""

import json

import numpy as np
import pytest

from clie_blocks import diagnose
from clie_blocks.analysis import cli
from clie_blocks.analysis.examples import EXAMPLES, FOLDER
from tests.scripts import script

RUBS = 0.4  # N m, dry friction of the thigh
LEVEL = 0.004  # N m, dry friction of the elbow on the motor side


def test_every_example_is_listed_and_there(capsys):
    assert cli.main(["example"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed and text in printed for name, text in EXAMPLES.items())
    assert {path.name for path in FOLDER.iterdir() if (path / "robot.toml").is_file()
            } == set(EXAMPLES)
    assert sum(path.stat().st_size for path in FOLDER.rglob("*.gz")) < 600_000


def test_an_example_names_the_next_command_and_may_be_written_again(tmp_path, capsys):
    folder = tmp_path / "my arm"
    for _ in range(2):
        assert cli.main(["example", "friction-arm", str(folder)]) == 0
        assert f"clie diagnose '{folder}' -o out" in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == [
        "log-1.csv.gz", "log-2.csv.gz", "log-3.csv.gz", "robot.toml"]


def test_a_file_of_the_user_is_left_as_it_is(tmp_path, capsys):
    (tmp_path / "robot.toml").write_text("joints = 7\n")
    assert cli.main(["example", "healthy-arm", str(tmp_path)]) == 2
    assert "left as it is" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["robot.toml"]


def test_an_unknown_example_names_the_nearest(capsys):
    assert cli.main(["example", "friction"]) == 2
    assert "did you mean 'friction-arm'" in capsys.readouterr().err


def test_the_example_is_the_robot_of_the_script(tmp_path):
    """The shipped logs are those of the other engine, with the friction that the script states."""
    pytest.importorskip("mujoco")
    made_by = script("examples")
    assert {*made_by.EXAMPLES, *(script(name).NAME for name in (
        "example_leg", "example_servo_arm"))} == set(EXAMPLES)
    assert made_by.EXAMPLES["friction-arm"] == {"level": [0.0, LEVEL]}
    made_by.make("friction-arm", tmp_path)
    assert (tmp_path / "robot.toml").read_text() == (
        FOLDER / "friction-arm" / "robot.toml").read_text()
    made, shipped = (np.genfromtxt(folder / "log-3.csv.gz", delimiter=",", names=True)
                     for folder in (tmp_path, FOLDER / "friction-arm"))
    for name in ("q1", "q2"):  # to a few steps of the encoder in any version of the engine
        assert np.abs(made[name] - shipped[name]).max() < 1e-3


def test_the_leg_is_that_of_its_script(tmp_path):
    pytest.importorskip("mujoco")
    made_by, shipped = script("example_leg"), FOLDER / "leg-without-torque"
    assert made_by.FRICTION.tolist() == [0.0, RUBS, 0.0]
    made_by.make(tmp_path)
    for name in ("robot.toml", "go2-leg.urdf"):
        assert (tmp_path / name).read_text() == (shipped / name).read_text()
    made, logged = (np.genfromtxt(folder / "log-3.csv.gz", delimiter=",", names=True)
                    for folder in (tmp_path, shipped))
    assert logged.dtype.names == ("time", "q_hip", "q_thigh", "q_calf",
                                  "qd_hip", "qd_thigh", "qd_calf")
    for name in logged.dtype.names:
        assert np.abs(made[name] - logged[name]).max() < 1e-3


def test_the_servo_arm_is_that_of_its_script(tmp_path):
    pytest.importorskip("mujoco")
    made_by, shipped = script("example_servo_arm"), FOLDER / "servo-arm"
    made_by.make(tmp_path)
    for name in ("robot.toml", "so101.urdf"):
        assert (tmp_path / name).read_text() == (shipped / name).read_text()
    made, logged = (np.genfromtxt(folder / "log-2.csv.gz", delimiter=",", names=True)
                    for folder in (tmp_path, shipped))
    for name in logged.dtype.names:  # to a few steps of the encoder in any version of the engine
        assert np.abs(made[name] - logged[name]).max() < 5 * made_by.STEP


@pytest.mark.slow
def test_the_thigh_of_the_leg_rubs_though_no_torque_is_logged(tmp_path):
    assert cli.main(["example", "leg-without-torque", str(tmp_path / "leg")]) == 0
    found = diagnose(str(tmp_path / "leg")).to_dict()
    first = found["effects"][0]
    assert first["effect"] == "coulomb" and first["joint"] == [2]
    assert first["parameters"]["level"]["value"] == pytest.approx([RUBS], rel=0.1)
    assert found["closed_percent"]["value"] > 90


@pytest.mark.slow
def test_one_command_diagnoses_both_arms(tmp_path, capsys):
    for name in ("healthy-arm", "friction-arm"):
        assert cli.main(["example", name, str(tmp_path / "arms" / name)]) == 0
    assert cli.main(["diagnose", str(tmp_path / "arms"), "-o", str(tmp_path / "out")]) == 0
    answers = json.loads((tmp_path / "out" / "answers.json").read_text())
    assert answers["healthy-arm"]["verdict"] == "none"
    first = answers["friction-arm"]["effects"][0]
    assert first["effect"] == "coulomb" and first["joint"] == [2]
    assert first["parameters"]["level"]["value"] == pytest.approx([LEVEL], rel=0.01)  # motor side
    assert (tmp_path / "out" / "friction-arm.html").stat().st_size > 10_000
