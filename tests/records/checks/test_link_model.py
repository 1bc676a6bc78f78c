"""A model of the links against the log: sign, zero, order, gear side, and not for faults."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.records import Record, read_robot
from clie_blocks.analysis.records.checks.link_model import check_link_model
from clie_blocks.rigid_body.dynamics import inverse_dynamics

ARM = Path(__file__).parents[3] / "docs" / "arms" / "six_axis.urdf"
TIME = np.arange(0.0, 10.0, 2e-3)
RATIO, ROTOR, DRAG, FRICTION = 100.0, 2e-2, 0.4, 2e-3  # of the motors, times their ratio
HOME = np.array([0.0, -1.0, 1.2, -1.5, -1.5, 0.3])
NAMES = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


@pytest.fixture
def stated(tmp_path):
    """Function from lines in [links] to a robot."""
    if not ARM.is_file():
        pytest.skip("the model is beside the tests only in a checkout")

    def robot(lines=""):
        file = tmp_path / "robot.toml"
        file.write_text(f'joints = 6\n[motor]\ngear_ratio = {[RATIO] * 6}\n[links]\n'
                        f'model = "{ARM}"\ntip = "flange"\n{lines}\n')
        return read_robot(file)

    return robot


def motion(seed=0):
    """Positions, velocities and accelerations of sums of sines."""
    rng, parts = np.random.default_rng(seed), []
    for home in HOME:
        f, size, phase = rng.uniform([0.05, 0.05, 0.0], [0.8, 0.3, 6.0], (4, 3)).T[:, :, None]
        w = 2 * np.pi * f
        wave = w * TIME + phase
        parts.append([home + np.sum(size * np.sin(wave), 0), np.sum(size * w * np.cos(wave), 0),
                      np.sum(-size * w**2 * np.sin(wave), 0)])
    return np.array(parts).transpose(1, 2, 0)


def logged(tree, robot, seed=0, gain=1.0, more=0.0):
    """Log of an arm with these links."""
    q, dq, ddq = motion(seed)
    rng = np.random.default_rng(seed)
    u = (inverse_dynamics(tree, q, dq, ddq) / RATIO + more * (q - HOME) + ROTOR * ddq + DRAG * dq
         + FRICTION * np.sign(dq)) / gain
    return Record(time=TIME, q=q + 2e-5 * rng.standard_normal(q.shape),
                  u=u + 1e-5 * rng.standard_normal(q.shape), joints=NAMES, robot=robot)


def only(findings):
    (finding,) = findings
    return finding


def test_the_right_model_is_no_finding(stated):
    robot = stated()
    assert check_link_model(logged(robot.tree, robot), robot) == []


@pytest.mark.parametrize("lines, what, fix", [
    ("sign = [1, -1, 1, 1, 1, 1]", "shoulder_lift counts in the other direction",
     "sign = [1, 1, 1, 1, 1, 1]"),
    ("sign = [1, 1, 1, 1, -1, 1]", "wrist_2 counts in the other direction",
     "sign = [1, 1, 1, 1, 1, 1]"),
    ("zero_rad = [0, 0, 1.5707963, 0, 0, 0]", "elbow begins -90 degrees away",
     "zero_rad = [0, 0, 0, 0, 0, 0]"),
    ("zero_rad = [0, 0, 0, 3.1415927, 0, 0]", "wrist_1 begins +180 degrees away",
     "zero_rad = [0, 0, 0, 0, 0, 0]"),
    ("sign = [1, -1, 1, 1, 1, 1]\nzero_rad = [0, -1.5707963, 0, 0, 0, 0]",
     "shoulder_lift counts in the other direction and begins -90 degrees away",
     "sign = [1, 1, 1, 1, 1, 1] in [links]; zero_rad = [0, 0, 0, 0, 0, 0]")])
def test_a_joint_that_counts_otherwise_is_named_with_the_line_that_mends_it(stated, lines, what,
                                                                            fix):
    right, wrong = stated(), stated(lines)
    finding = only(check_link_model(logged(right.tree, right), wrong))
    assert (finding.severity, finding.check) == ("error", "links.joints")
    assert what in finding.what and fix in finding.fix and finding.joint in what
    mended = stated(fix.replace(" in [links]; ", "\n"))
    assert check_link_model(logged(right.tree, right), mended) == []


@pytest.mark.parametrize("gravity", [[9.81, 0.0, 0.0], [0.0, 0.0, 9.81]])
def test_an_arm_that_hangs_or_stands_on_a_wall_is_named(stated, gravity):
    robot = stated()
    record = logged(robot.tree.with_gravity(gravity), robot)
    finding = only(check_link_model(record, robot))
    line = f"gravity_m_s2 = [{', '.join(f'{x:g}' for x in gravity)}]"
    assert finding.check == "links.joints" and line in finding.fix
    assert check_link_model(record, stated(line)) == []


def test_links_without_weight_are_compared_without_it(stated):
    robot = stated()
    robot = dataclasses.replace(robot, nominal=dataclasses.replace(robot.nominal, gravity=False))
    assert check_link_model(logged(robot.tree.with_gravity([0.0] * 3), robot), robot) == []


def test_two_joints_that_are_exchanged_are_named(stated):
    robot = stated()
    record = logged(robot.tree, robot)
    order = [0, 2, 1, 3, 4, 5]
    exchanged = record.replace(q=record.q[:, order], u=record.u[:, order])
    finding = only(check_link_model(exchanged, robot))
    assert "shoulder_lift and elbow are exchanged" in finding.what
    assert "shoulder_pan, elbow, shoulder_lift, wrist_1" in finding.fix


def test_torques_of_the_joint_side_are_named(stated):
    robot = stated()
    record = logged(robot.tree, robot)
    finding = only(check_link_model(record.replace(u=RATIO * record.u), robot))
    assert "u is on the joint side of the gear" in finding.what


def test_positions_in_degrees_are_named_with_the_line_that_mends_it(stated):
    robot = stated()
    record = logged(robot.tree, robot)
    finding = only(check_link_model(record.replace(q=np.degrees(record.q)), robot))
    assert "q is in degrees" in finding.what and 'q = "deg" in [units]' in finding.fix


def test_gear_ratios_upside_down_are_named_with_the_line_that_mends_it(stated):
    robot = stated()
    record, motor = logged(robot.tree, robot), robot.motor
    wrong = dataclasses.replace(robot, motor=dataclasses.replace(
        motor, gear_ratio=1.0 / motor.gear_ratio))
    finding = only(check_link_model(record, wrong))
    assert "gear_ratio is the inverse" in finding.what
    line = ", ".join([f"{RATIO:g}"] * 6)
    assert f"gear_ratio = [{line}], motor turns per joint turn" in finding.fix


def test_links_that_no_small_change_mends_are_a_warning(stated):
    robot = stated()
    heavy = stated("payload_kg = 8.0")
    finding = only(check_link_model(logged(robot.tree, robot), heavy))
    assert (finding.severity, finding.check) == ("warning", "links.opposed")
    assert "payload_kg" in finding.fix


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("fault", ["masses", "payload", "tilt", "weak drives", "spring"])
def test_a_fault_of_the_robot_is_no_wrong_joint_of_the_model(stated, fault, seed):
    robot, rng = stated(), np.random.default_rng(seed)
    tree, gain, more = robot.tree, 1.0, 0.0
    if fault == "masses":
        share = rng.uniform(0.5, 1.5, 6)
        tree = dataclasses.replace(tree, mass=share * tree.mass,
                                   moment=share[:, None] * tree.moment,
                                   inertia=share[:, None, None] * tree.inertia)
    elif fault == "payload":
        tree = stated(f"payload_kg = {rng.uniform(0.5, 6.0)}").tree
    elif fault == "tilt":
        lean = rng.uniform(-0.5, 0.5)
        tree = tree.with_gravity([0.0, 9.81 * np.sin(lean), -9.81 * np.cos(lean)])
    elif fault == "weak drives":
        gain = rng.uniform(0.5, 1.0, 6)
    else:
        more = rng.uniform(0.0, 0.3, 6)
    record = logged(tree, robot, seed, gain, more)
    assert [one for one in check_link_model(record, robot) if one.severity == "error"] == []


def test_no_links_and_a_joint_at_rest_say_nothing(stated):
    robot = stated()
    record = logged(robot.tree, robot)
    still = record.q.copy()
    still[:, 3] = 1.0
    assert check_link_model(record.replace(q=still), robot) == []
    assert check_link_model(record, dataclasses.replace(robot, tree=None)) == []
    assert check_link_model(record, None) == []
