"""Robot files that name a URDF or MJCF as their links, and ``clie robot``, which starts them."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.cli import main
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.records import read_robot
from clie_blocks.errors import RecordError
from clie_blocks.rigid_body.dynamics import gravity_torque
from clie_blocks.rigid_body.model_file import read_model
from clie_blocks.robot_loop.links import gravity_torque as weight_of_links

ARM = Path(__file__).parents[2] / "docs" / "arms" / "six_axis.urdf"
JOINTS = '["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]'


def robot_file(folder, links, top=f"joints = 6\njoint_names = {JOINTS}\n"):
    shutil.copy(ARM, folder / "arm.urdf")
    path = folder / "robot.toml"
    path.write_text(f"{top}\n[links]\nmodel = \"arm.urdf\"\n{links}\n")
    return path


def test_the_links_of_a_robot_are_those_of_its_model(tmp_path):
    robot = read_robot(robot_file(tmp_path, 'tip = "flange"\npayload_kg = 2.0'))
    tree = read_model(ARM, tip="flange", payload=2.0)
    q = np.random.default_rng(1).normal(size=(5, 6))
    np.testing.assert_allclose(gravity_torque(robot.tree, q), gravity_torque(tree, q))
    links = stated_links(robot, q[0])
    assert links.has_gravity and links.has_coupling and not links.is_planar
    np.testing.assert_allclose(weight_of_links(links, q), gravity_torque(tree, q), atol=1e-11)


def test_joints_take_the_names_of_the_model_where_the_file_has_none(tmp_path):
    robot = read_robot(robot_file(tmp_path, 'tip = "flange"', top="joints = 6\n"))
    assert robot.joints == tuple(name.strip(' "') for name in JOINTS.strip("[]").split(","))


def test_logs_may_have_names_of_their_own(tmp_path):
    robot = read_robot(robot_file(
        tmp_path, f"tip = \"flange\"\nmodel_joints = {JOINTS}",
        top='joints = 6\njoint_names = ["a1", "a2", "a3", "a4", "a5", "a6"]\n'))
    assert robot.joints[0] == "a1" and robot.tree.names[0] == "shoulder_pan"


def test_a_model_without_gravity_or_coupling_is_one_of_joints(tmp_path):
    path = robot_file(tmp_path, "[nominal]\ngravity = false\ncoupling = false")
    links = stated_links(read_robot(path), np.zeros(6))
    assert links.known and not links.has_gravity and not links.has_coupling


@pytest.mark.parametrize(("links", "top", "message"), [
    ('tip = "flange"', "joints = 7\n", "has 6 joints that move, .*the robot 7"),
    ("mass_kg = [1, 1, 1, 1, 1, 1]", "joints = 6\n", "both a model and mass"),
    ("locked = 3", "joints = 6\n", "locked must be names with numbers"),
    ("gravity_m_s2 = [0, 1]", "joints = 6\n", "three numbers along x, y and z"),
    ('tip = "flang"', "joints = 6\n", r"robot\.toml:4: \[links\] model: .*no link 'flang'"),
])
def test_a_model_that_does_not_fit_is_named_with_its_line(tmp_path, links, top, message):
    with pytest.raises(RecordError, match=message):
        read_robot(robot_file(tmp_path, links, top))


def test_a_tip_without_a_model_is_refused(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text('joints = 1\n[links]\ntip = "flange"\n')
    with pytest.raises(RecordError, match='tip belongs to a model.*model = "arm.urdf"'):
        read_robot(path)


def test_clie_robot_starts_a_file_that_reads_as_it_stands(tmp_path, capsys):
    assert main(["robot", str(ARM), "-o", str(tmp_path)]) == 0
    assert "are for you" in capsys.readouterr().out
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.links.tip == "flange" and robot.tree.n == robot.n == 6
    assert main(["robot", str(tmp_path / "robot.toml")]) == 0
    shown = capsys.readouterr().out
    assert "17.05 kg" in shown and "shoulder_lift" in shown and "[motor] gear_ratio" in shown


def test_the_lines_for_the_user_can_be_taken_as_they_are_written(tmp_path):
    assert main(["robot", str(ARM), "-o", str(tmp_path)]) == 0
    path = tmp_path / "robot.toml"
    path.write_text(path.read_text().replace("# ? ", ""))
    with pytest.raises(RecordError, match="must be greater than 0"):  # the drives are to be filled
        read_robot(path)
    path.write_text(path.read_text().replace("peak_torque_nm = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
                                             "peak_torque_nm = 10.0"))
    robot = read_robot(path)
    assert robot.controller.law == "pd" and robot.links.payload == 0.0


MINE = """<mujoco><compiler angle="radian"/><default><motor gear="50"/></default><worldbody>
<body name="upper"><inertial pos="0.2 0 0" mass="2" diaginertia="0.02 0.02 0.02"/>
<joint name="shoulder" axis="0 -1 0" armature="0.5" damping="1.8"/>
<body name="lower" pos="0.4 0 0"><inertial pos="0.15 0 0" mass="1" diaginertia="6e-3 6e-3 6e-3"/>
<joint name="elbow" axis="0 -1 0" armature="0.075"/></body></body></worldbody>
<actuator><motor joint="shoulder" gear="100"/><motor joint="elbow"/></actuator></mujoco>"""


def test_a_robot_file_begins_from_a_model_and_logs_together(tmp_path):
    """The example's own robot file states the same gears, rotors and gains."""
    (tmp_path / "mine.xml").write_text(MINE)
    assert main(["robot", str(tmp_path / "mine.xml"), "--logs", str(FOLDER / "friction-arm"),
                 "-o", str(tmp_path)]) == 0
    begun = read_robot(tmp_path / "robot.toml")
    stated = read_robot(FOLDER / "friction-arm" / "robot.toml")
    np.testing.assert_allclose(begun.motor.gear_ratio, stated.motor.gear_ratio)
    np.testing.assert_allclose(begun.motor.inertia, stated.motor.inertia)
    np.testing.assert_allclose(begun.controller.kp, stated.controller.kp, rtol=1e-3)
    np.testing.assert_allclose(begun.controller.kd, stated.controller.kd, rtol=1e-3)
    assert begun.tree.mass.sum() == 3.0


def test_a_model_with_other_joints_than_the_logs_is_refused(tmp_path, capsys):
    assert main(["robot", str(ARM), "--logs", str(FOLDER / "friction-arm"),
                 "-o", str(tmp_path)]) == 2
    assert "has 2 joints, and" in capsys.readouterr().err
    assert not (tmp_path / "robot.toml").exists()


def test_clie_robot_leaves_a_file_that_is_there(tmp_path, capsys):
    (tmp_path / "robot.toml").write_text("joints = 2\n")
    assert main(["robot", str(ARM), "-o", str(tmp_path)]) == 2
    assert "is left as it is" in capsys.readouterr().err
    assert (tmp_path / "robot.toml").read_text() == "joints = 2\n"


def test_clie_robot_starts_from_a_log_and_from_nothing(tmp_path, capsys):
    log = tmp_path / "log-1.csv"
    log.write_text("time,q_hip,q_knee,u_hip,u_knee\n" + "".join(
        f"{0.01 * k},{np.sin(0.1 * k)},{np.cos(0.1 * k)},0,0\n" for k in range(500)))
    assert main(["robot", str(log), "-o", str(tmp_path)]) == 0
    assert read_robot(tmp_path / "robot.toml").joints == ("hip", "knee")
    assert main(["robot", "--joints", "3", "-o", str(tmp_path / "new"), "--json"]) == 0
    assert read_robot(tmp_path / "new" / "robot.toml").n == 3
    assert '"lines_for_you"' in capsys.readouterr().out
