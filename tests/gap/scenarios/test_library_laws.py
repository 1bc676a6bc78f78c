"""Robots of another engine under laws of the library: stated, described wrong, or not at all."""

import dataclasses

import control as ct
import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from law_robots import KD, KP, ROBOTS, rightly  # noqa: E402

from clie_blocks.analysis.cli import main as clie  # noqa: E402
from clie_blocks.analysis.gap.batch import read  # noqa: E402
from clie_blocks.analysis.gap.controller.check import check_controller  # noqa: E402
from clie_blocks.analysis.gap.diagnosis import diagnose  # noqa: E402
from clie_blocks.labels import DiagramError  # noqa: E402
from clie_blocks.robot_loop.sampled_law import sampled_law  # noqa: E402


def checked(robot, folder, effect="", seconds=4.0):
    robot.write(folder, effect, seconds=seconds)
    problem = read(folder)
    return problem, check_controller(problem)


def values(law):
    return {name: value for name, (value, _, _) in law.numbers.items()}


@pytest.mark.parametrize("name", ["friction feedforward", "command low-pass", "PID that winds up",
                                  "hobby servo with dead band and punch"])
def test_a_law_that_is_stated_gives_the_commands(name, tmp_path):
    _, check = checked(rightly(name), tmp_path, seconds=2.0)
    assert check.as_stated and not check.differences


@pytest.mark.slow
@pytest.mark.parametrize("name", ["acceleration feedforward", "PID at its limit",
                                  "cascade with a slower outer loop"])
def test_another_law_that_is_stated_gives_the_commands(name, tmp_path):
    _, check = checked(rightly(name), tmp_path, seconds=2.0)
    assert check.as_stated and not check.differences


def test_a_feedforward_that_no_one_stated_is_found_with_what_to_state(tmp_path):
    problem, check = checked(ROBOTS["velocity feedforward of another gain"], tmp_path)
    (law,) = check.laws
    assert law.name == "PD with feedforward of velocity" and law.probability > 0.9
    assert values(law) == pytest.approx(
        {"kp": KP, "kd": KD, "feedforward_velocity": 0.6 * KD}, rel=1e-3)
    assert check.misdescribed and not check.unexplained and not check.learned
    corrected = check.corrected(problem)
    for log in corrected.logs:
        np.testing.assert_allclose(corrected.law.commands(log), log.u, atol=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "words", "numbers"), [
    ("PID at its limit", "PID with a limit of 1.6 N m", {"ki": 60.0}),
    ("hobby servo with dead band and punch", "dead band", {"dead_band": 0.01, "punch": 0.144})])
def test_a_law_that_is_described_wrong_is_named_with_its_numbers(name, words, numbers, tmp_path):
    _, check = checked(ROBOTS[name], tmp_path, seconds=6.0)
    (law,) = check.laws
    assert words in law.name and not check.unexplained
    assert {key: values(law)[key] for key in numbers} == pytest.approx(numbers, rel=5e-3)


def test_a_law_that_no_one_states_is_learned_from_the_log(tmp_path):
    _, check = checked(ROBOTS["PD, law unknown"], tmp_path)
    (law,) = check.laws
    assert check.learned and check.as_stated and law.name == "PD"
    assert values(law) == pytest.approx({"kp": KP, "kd": KD}, rel=1e-3)
    assert set(law.state) >= {'law = "pd"', "Kp = [30]", "Kd = [1.6]"}


@pytest.mark.slow
def test_a_statement_that_is_followed_is_right(tmp_path):
    robot = ROBOTS["acceleration feedforward"]
    _, check = checked(robot, tmp_path / "wrong")
    lines = dict(line.split(" = ", 1) for line in robot.controller.splitlines())
    lines |= dict(line.split(" = ", 1) for line in check.laws[0].state)
    text = "\n".join(f"{key} = {value}" for key, value in lines.items())
    _, again = checked(dataclasses.replace(robot, controller=text), tmp_path / "right")
    assert again.as_stated or {one.name for one in again.parameters} <= {
        "feedforward_velocity", "feedforward_acceleration"}  # which were told in five digits


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "verdict"), [("", "none"), ("coulomb", "effect")])
def test_a_law_that_is_described_wrong_accuses_no_joint_and_hides_no_effect(
        effect, verdict, tmp_path):
    ROBOTS["PID at its limit"].write(tmp_path, effect, seconds=6.0)
    found = diagnose(read(tmp_path))
    assert found.verdict == verdict and found.controller.laws
    assert "The law that ran is" in str(found) or "the law that ran is" in str(found)
    names = {row["effect"] for row in found.to_dict()["effects"][:1]}
    assert names <= {"none", "coulomb", "asymmetric_coulomb", "stribeck", "presliding"}


@pytest.mark.slow
def test_the_check_of_a_log_names_the_law_that_a_diagnosis_names(tmp_path, capsys):
    ROBOTS["command low-pass"].write(tmp_path, seconds=4.0)
    assert clie(["check", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "[law.other] joint1: The law that ran is PD with a low-pass of the command" in said
    assert "[law.gain]" not in said and "another law than stated" in said


def test_gains_in_degrees_are_told_by_the_factor(tmp_path):
    robot = ROBOTS["pid"]
    text = robot.controller.replace("Kp = 30.0", "Kp = 0.5236").replace(
        "Kd = 1.6", "Kd = 0.027925").replace("Ki = 60.0", "Ki = 1.0472")
    _, check = checked(dataclasses.replace(robot, controller=text), tmp_path)
    assert not check.unexplained and any("per degree" in one for one in check.differences)


def test_a_law_that_needs_samples_to_come_is_refused_with_the_remedy():
    ahead = ct.tf([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]], [[[1.0, 0.5], [1.0, 0.5]]], 0.002,
                  inputs=["q_d[0]", "q[0]"], outputs=["u[0]"])
    with pytest.raises(DiagramError, match="samples that are still to come"):
        sampled_law(ahead, 0.002)
