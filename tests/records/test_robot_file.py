"""`robot.toml`: read whole, or refused with field, file, line and the nearest name."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records import read_robot
from clie_blocks.analysis.records import robot as robot_module
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Motor
from clie_blocks.errors import RecordError

WHOLE = """
name = "arm"
joints = 2
joint_names = ["shoulder", "elbow"]

[motor]                       # a comment
gear_ratio = [100.0, 50.0]
inertia_kgm2 = 0.02
inertia_tolerance = 0.01

[controller]
Kp = [10.0, 8.0]
Kd = [5.0, 4.0]
velocity_filter_highpass_rad_s = 200.0
velocity_filter_lowpass_rad_s = 300.0
velocity_filter_discretisation = "tustin"
sample_time_s = 0.001
hold = "zero-order"
command_resolution_nm = 0.005

[encoder]
mounting = "joint side"
resolution_rad = 1e-4

[experiment.log-1]
excitation = "multisine"
start_rad = [0.1, 0.2]
frequencies_hz = [[0.1, 0.2, 0.3], [0.4, 0.5]]
amplitudes_nm = [1.0, 2.0]

[units]
u = "V"

[columns]
q = "actual_{joint}"
"""


def robot_file(tmp_path, text):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    return path


def test_a_whole_file(tmp_path):
    robot = read_robot(robot_file(tmp_path, WHOLE))
    assert (robot.n, robot.name, robot.joints) == (2, "arm", ("shoulder", "elbow"))
    np.testing.assert_array_equal(robot.motor.gear_ratio, [100, 50])
    np.testing.assert_array_equal(robot.motor.inertia, [0.02, 0.02])
    assert robot.motor.inertia_tolerance == 0.01
    assert robot.motor.peak_torque is None
    assert robot.controller.law == "pd"
    assert robot.controller.velocity_filter == "two_corner"
    assert robot.controller.discretisation == "tustin"
    np.testing.assert_array_equal(robot.controller.command_resolution, [0.005, 0.005])
    assert robot.encoder.mounting == "joint side"
    experiment = robot.experiments["log-1"]
    np.testing.assert_array_equal(experiment.start, [0.1, 0.2])
    np.testing.assert_array_equal(experiment.frequencies[1], [0.4, 0.5])
    np.testing.assert_array_equal(experiment.amplitudes[1], [2.0])
    assert robot.units == {"u": "V"}
    assert robot.columns == {"q": "actual_{joint}"}
    assert not robot.motor.gear_ratio.flags.writeable


def line_of(text):
    return WHOLE[:WHOLE.index(text)].count("\n") + 1


@pytest.mark.parametrize("old, new, message", [
    ("gear_ratio =", "gear_ration =", r"\[motor\] gear_ration .*did you mean 'gear_ratio'"),
    ("[100.0, 50.0]", "[100.0, 50.0, 1]", r"\[motor\] gear_ratio has 3 entries.*2 joints"),
    ("[100.0, 50.0]", "[100.0, 0.0]", r"gear_ratio must not be 0"),
    ("[100.0, 50.0]", '"high"', r"gear_ratio must be a number per joint, got 'high'"),
    ("[100.0, 50.0]", "[true, false]", r"gear_ratio must be a number per joint"),
    ("[100.0, 50.0]", "[inf, 1.0]", r"gear_ratio must be finite"),
    ("[100.0, 50.0]", "[[1.0], [2.0]]", r"gear_ratio must be a number per joint"),
    ('"tustin"', '"tustn"', r"did you mean 'tustin'"),
    ("sample_time_s = 0.001", "sample_time_s = [0.001]", r"sample_time_s must be a number"),
    ("sample_time_s = 0.001", "sample_time_s = 0", r"greater than 0"),
    ('"multisine"', "3", r"excitation must be text in quotes"),
    ("[[0.1, 0.2, 0.3], [0.4, 0.5]]", "0.3", r"must be a list with one entry per joint"),
    ('u = "V"', 'uu = "V"', r"\[units\] uu .*did you mean 'u'"),
    ('"shoulder", "elbow"', '"elbow", "elbow"', r"joint_names must list 2 different names"),
])
def test_faults_name_file_line_and_field(tmp_path, old, new, message):
    path = robot_file(tmp_path, WHOLE.replace(old, new))
    with pytest.raises(RecordError, match=f"robot.toml:{line_of(old)}: .*{message}"):
        read_robot(path)


@pytest.mark.parametrize("text, message", [
    ("", "'joints' is missing"), ("joints = 0", "must be the number of joints"),
    ("joints = true", "must be the number of joints"),
    ("joints = 1\nname =\n", "not valid TOML.*line 2"),
    ("joints = 1\nmotor = 3", "must be a section"),
    ("joints = 1\nengine = 3", "known: name"),
    ("joints = 1\n[controller]\nKp = 1", r":2: \[?controller.* needs Kd"),
    ('joints = 1\n[controller]\nlaw = "cascade"\nKp = 1', "needs Kv"),
    ("joints = 1\n[experiment]\nlog = 1", "must be a section"),
    ("joints = 1\n[nominal]\ngravity = 1", "must be true or false"),
])
def test_files_that_are_no_robot(tmp_path, text, message):
    with pytest.raises(RecordError, match=message):
        read_robot(robot_file(tmp_path, text))


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(RecordError, match="No such file"):
        read_robot(tmp_path / "robot.toml")
    (tmp_path / "robot.toml").write_bytes(b"joints = 1 # \xff")
    with pytest.raises(RecordError, match="UTF-8"):
        read_robot(tmp_path / "robot.toml")


def test_a_section_given_to_two_robots_stays_as_it_was():
    motor = Motor(gear_ratio=100.0)
    assert Robot(2, motor=motor).motor.gear_ratio.shape == (2,)
    assert Robot(3, motor=motor).motor.gear_ratio.shape == (3,)
    assert motor.gear_ratio.shape == (1,)


@pytest.mark.parametrize("known, law", [
    ({}, "unknown"), ({"kp": 1.0, "kd": 1.0}, "pd"),
    ({"law": "cascade", "kp": 160.0, "kv": 243.0, "velocity_filter": "two_tap"}, "cascade"),
    ({"law": "servo", "kp": 0.3, "saturation": 1.0, "supply": 7.4}, "servo")])
def test_each_law_can_be_stated(known, law):
    assert Controller(**known).law == law


def test_every_blind_robot_is_understood(shared):
    files = sorted(shared.glob("blind/*/trial-*/robot.toml"))
    if not files:
        pytest.skip("needs the blind trials")
    for path in files:
        robot = read_robot(path)
        assert robot.controller.law == "pd"
        assert robot.controller.discretisation == "tustin"
        assert {"log-1", "log-2", "log-3"} == set(robot.experiments)


@pytest.mark.parametrize("section", ["motor", "links", "nominal", "controller", "encoder"])
def test_an_unknown_key_is_answered_with_all_keys_of_its_section(tmp_path, section):
    keys = [key for field in dataclasses.fields(robot_module.Robot) if field.name == section
            for part in dataclasses.fields(type(field.default)) for key in part.metadata["keys"]]
    key = max(keys, key=len)
    with pytest.raises(RecordError, match=rf"is not a key of \[{section}\]") as refused:
        read_robot(robot_file(tmp_path, f"joints = 1\n[{section}]\n{key[:-1]}x = 1\n"))
    listed = str(refused.value).partition("known: ")[2].split(", ")
    assert sorted(listed) == sorted(keys)
    assert listed[0] == key


@pytest.mark.parametrize("text, message", [
    ("joints = 1\nKp = 2", r":2: Kp is not a key of a robot file.*it belongs in \[controller\]"),
    ("joints = 1\n[motor]\nKp = 2", r":3: \[motor\] Kp .*it belongs in \[controller\]"),
    ("joints = 1\n[controler]\nKp = 2", r":2: controler .*did you mean 'controller'\? known: "
     "controller, .*name, joints, joint_names, motor, links, nominal.*columns"),
    ("joints = 1\n[controller]\nkp = 2\nKd = 1", r"did you mean 'Kp'"),
    ("joints = 1\n[units]\ntorque = 'N m'", "known: .*time, q, u, qd, pe, dq, tau"),
    ("joints = 1\n[experiment.log-1]\nperiod = 1",
     r"is not a key of \[experiment.log-1\].*periods_s")])
def test_where_an_unknown_key_belongs(tmp_path, text, message):
    with pytest.raises(RecordError, match=message):
        read_robot(robot_file(tmp_path, text))
