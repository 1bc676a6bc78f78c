"""Robots as their files state them: parameters by hand, boxes that hold them, clear refusals."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.records import read_robot
from clie_blocks.analysis.stability_report.study import paper_study, robot_study
from clie_blocks.errors import RecordError
from clie_blocks.signals import DiagramError

SERVO = """
name = "servo"
joints = 1
[motor]
gear_ratio = [37.0]
inertia_kgm2 = [0.000379]
viscous_friction_nms = [0.00042]
inertia_tolerance = 0.01
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = [0.0142]
[links]
length_m = [0.238]
mass_kg = [0.881]
com_m = [0.223]
inertia_kgm2 = [0.001248]
joint_viscous_friction_nms = [0.06]
[controller]
Kp = [1.42]
Kd = [0.233]
[experiment.log-1]
excitation = "paper_pe"
set_point_rad = [-1.37]
scale = [0.22]
"""


def robot(tmp_path, text=SERVO):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    return read_robot(path)


def test_servo_parameters_by_hand(tmp_path):
    study = robot_study(robot(tmp_path))
    inertia = 37 * 0.000379 + (0.881 * 0.223**2 + 0.001248) / 37
    weight = 0.881 * 0.223 * 9.81 / 37
    np.testing.assert_allclose(study.joints.theta, [
        (37 * 0.00042 + 0.06 / 37) / inertia, 1 / inertia, weight * np.cos(-1.37) / inertia])
    assert (study.joints.kp, study.joints.kd) == ([1.42], [0.233])
    assert study.scale == [0.22] and study.q_d == [-1.37]


def test_servo_plant_is_a_pendulum(tmp_path):
    """The simulated plant has the load of every pose, the joints (9) that of the set-point."""
    study = robot_study(robot(tmp_path))
    for q in (-1.37, 0.0, 1.0):
        ddq = study.plant.dynamics(0.0, np.array([q, 0.0]), np.zeros(1))[1]
        expected = -study.joints.d[0] * np.cos(q) / np.cos(-1.37)
        assert ddq == pytest.approx(expected, rel=1e-6)


def test_box_holds_the_parameters_and_grows_with_tolerances(tmp_path):
    study = robot_study(robot(tmp_path))
    assert np.all(study.box.lower <= study.joints.theta)
    assert np.all(study.joints.theta <= study.box.upper)
    text = SERVO.replace("0.15", "0.0").replace("= 0.01\n", "= 0.0\n")
    exact = robot_study(robot(tmp_path, text))
    width, narrow = (s.box.upper - s.box.lower for s in (study, exact))
    assert np.all(narrow <= width + 1e-12) and narrow[0] < 0.2 * width[0]


def test_balanced_gain_makes_the_robot_converge_like_the_papers(tmp_path):
    from clie_blocks.analysis.theory.averaging import averaged_rates

    study = robot_study(robot(tmp_path))
    rate = averaged_rates(study.loop, [20.0])[0, 0]
    assert rate == pytest.approx(20 / 400)


def test_the_papers_box_holds_its_table_and_its_arm():
    study = paper_study()
    for theta in (paper.THETA, [1.99214, 1.9982, 0.49804, 0.49955, 0.0441, 0.0147]):
        assert np.all(study.box.lower <= np.array(theta) + 1e-4)
        assert np.all(np.array(theta) <= study.box.upper + 1e-4)


def test_gains_may_be_given(tmp_path):
    study = robot_study(robot(tmp_path), kp=2.0, kd=0.5)
    assert (study.joints.kp, study.joints.kd) == ([2.0], [0.5])
    assert paper_study().with_gains(kd=[4.0, 6.0]).joints.kd.tolist() == [4.0, 6.0]
    with pytest.raises(DiagramError, match="--kp needs 2 numbers"):
        paper_study().with_gains(kp=[1.0, 2.0, 3.0])


@pytest.mark.parametrize("line, message", [
    ("gear_ratio = [37.0]", "gear_ratio is missing"),
    ("Kp = [1.42]\nKd = [0.233]", "states no PD gains")])
def test_missing_facts_are_named(tmp_path, line, message):
    text = SERVO.replace(line, 'law = "unknown"' if "Kp" in line else "")
    with pytest.raises(RecordError, match=message):
        robot_study(robot(tmp_path, text))


def test_cascade_is_a_pd_law(tmp_path):
    text = SERVO.replace("Kp = [1.42]\nKd = [0.233]", 'law = "cascade"\nKp = [6.0]\nKv = [0.25]')
    joints = robot_study(robot(tmp_path, text)).joints
    assert (joints.kp, joints.kd) == ([1.5], [0.25])


@pytest.mark.parametrize("trial", ["trial-000", "trial-004", "trial-008"])
def test_practice_robots_can_be_studied(shared, trial):
    study = robot_study(read_robot(shared / "blind" / "practice" / trial / "robot.toml"))
    assert np.all(study.box.lower <= study.joints.theta)
    assert np.all(study.joints.theta <= study.box.upper)


def test_estimates_may_stand_in_for_the_parameters():
    study = paper_study().with_theta(paper.THETA_HAT[3])
    np.testing.assert_array_equal(study.joints.theta, paper.THETA_HAT[3])
    assert np.all(study.box.upper >= paper.THETA_HAT[3])
    assert np.all(study.box.lower <= paper_study().box.lower)


def test_a_balanced_gain_beats_every_scalar_one_on_the_papers_robot():
    from clie_blocks.analysis.theory.convergence import floquet_rates

    scalar, balanced = paper_study(), paper_study().balanced()
    assert np.ptp(scalar.gamma_diagonal) == 0 < np.ptp(balanced.gamma_diagonal)
    best = max(rates.slowest for rates in floquet_rates(scalar.loop, [40.0, 56.0, 72.0, 100.0]))
    assert floquet_rates(balanced.loop, [200.0])[0].slowest > 3 * best
