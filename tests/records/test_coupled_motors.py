"""Robot files and logs of robots whose motors turn several joints, or against theirs."""

import numpy as np
import pytest

from clie_blocks.analysis.records import read_record
from clie_blocks.analysis.records.robot_command import main
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.errors import RecordError

MODEL = """<mujoco><worldbody>
<body><joint name="a" axis="0 0 1"/><inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/>
<body pos="0.2 0 0"><joint name="b" axis="0 1 0"/>
<inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
LOG = "time,q1,q2,qd1,qd2,u1,u2\n" + "".join(
    f"{k / 100},{0.1 * k},{0.2 * k},{0.1 * k},0.5,1,2\n" for k in range(20))


@pytest.fixture
def file(tmp_path):
    def written(motor, more="", links='model = "arm.xml"'):
        (tmp_path / "arm.xml").write_text(MODEL)
        (tmp_path / "log.csv").write_text(LOG)
        path = tmp_path / "robot.toml"
        path.write_text(f"joints = 2\n[motor]\n{motor}\n[links]\n{links}\n{more}\n")
        return path

    return written


def test_positions_become_those_of_the_motors(file):
    path = file("motor_coupling = [[1, 0], [0.5, 1]]",
                '[experiment.log]\nset_point_rad = [1.0, 2.0]')
    robot, record = read_robot(path), read_record(path.parent / "log.csv")
    k = np.arange(20)
    assert record.q == pytest.approx(np.stack([0.1 * k, 0.15 * k], axis=1))
    assert record.qd[:, 1] == pytest.approx(0.5 - 0.05 * k)
    assert record.u[0] == pytest.approx([1.0, 2.0])
    assert robot.experiments["log"].set_point == pytest.approx([1.0, 1.5])
    assert any("Motors are coupled" in line for line in record.decisions)


def test_positions_of_the_motors_stay(file):
    path = file("motor_coupling = [[1, 0], [0.5, 1]]", '[encoder]\npositions = "motors"')
    assert read_record(path.parent / "log.csv").q[3] == pytest.approx([0.3, 0.6])


def test_a_gear_that_turns_against_its_joint_is_a_coupling(file):
    path = file("gear_ratio = [50, -60]")
    robot = read_robot(path)
    assert robot.motor.gear_ratio == pytest.approx([50.0, 60.0])
    assert robot.motor.coupling == pytest.approx(np.diag([1.0, -1.0]))
    assert read_record(path.parent / "log.csv").q[3] == pytest.approx([0.3, -0.6])


def test_a_signed_gear_turns_the_column_of_its_motor(file):
    robot = read_robot(file("gear_ratio = [50, -60]\nmotor_coupling = [[1, 0.3], [0, 1]]"))
    assert robot.motor.coupling == pytest.approx(np.array([[1.0, -0.3], [0.0, -1.0]]))


def test_the_identity_changes_nothing(file):
    path = file("motor_coupling = [[1, 0], [0, 1]]")
    assert read_robot(path).motor.coupling is None
    assert not any("coupled" in line for line in read_record(path.parent / "log.csv").decisions)


@pytest.mark.parametrize("line, message", [
    ("motor_coupling = [[1, 0], [0.5]]", r"robot.toml:3: \[motor\] motor_coupling must be"),
    ("motor_coupling = [1, 0]", r"robot.toml:3: .*as many rows as columns"),
    ("motor_coupling = [[1]]", "motor_coupling must be 2 rows of 2 numbers"),
    ("motor_coupling = [[1, 1], [1, 1]]", "cannot be inverted: some motion"),
    ("gear_ratio = [0, 1]", r"robot.toml:3: \[motor\] gear_ratio must not be 0")])
def test_what_cannot_be_a_coupling_is_refused(file, line, message):
    with pytest.raises(RecordError, match=message):
        read_robot(file(line))


def test_numbers_per_link_have_no_coupling(file):
    with pytest.raises(RecordError, match="go with links of a model"):
        read_robot(file("motor_coupling = [[1, 0], [0.5, 1]]",
                        links="mass_kg = 1\nlength_m = 1\ncom_m = 0.5"))


def test_the_check_of_a_file_shows_what_motors_turn(file, capsys):
    assert main([str(file("motor_coupling = [[1, 0], [0.5, 1]]"))]) == 0
    assert "b = +0.5 a +1 b" in capsys.readouterr().out
