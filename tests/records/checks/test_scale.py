"""The inertia that command and motion show, against the stated one."""

from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.blind.laws.arm import Arm
from clie_blocks.analysis.blind.laws.run import Reference
from clie_blocks.analysis.records import Record, read_robot
from clie_blocks.analysis.records.checks.scale import check_scale, inertia_ratios
from clie_blocks.rigid_body.dynamics import inverse_dynamics

ARM = Path(__file__).parents[3] / "docs" / "arms" / "six_axis.urdf"
TIME, RATIO = np.arange(0.0, 10.0, 2e-3), 100.0
HOME = np.array([0.0, -1.0, 1.2, -1.5, -1.5, 0.3])
LIGHT, HEAVY = 1e-6, 1e-3  # kg m^2: rotors that their links outweigh, and that outweigh them


@pytest.fixture
def stated(tmp_path):
    """Function from rotors to a robot."""
    if not ARM.is_file():
        pytest.skip("the model is beside the tests only in a checkout")

    def robot(rotors):
        file = tmp_path / "robot.toml"
        file.write_text(f'joints = 6\n[motor]\ngear_ratio = {[RATIO] * 6}\n'
                        f'inertia_kgm2 = {list(rotors)}\nviscous_friction_nms = {[1e-3] * 6}\n'
                        f'[links]\nmodel = "{ARM}"\ntip = "flange"\n[controller]\n'
                        f'Kp = {[10.0] * 6}\nKd = {[1.0] * 6}\n')
        return read_robot(file)

    return robot


def logged(robot, rotors, amplitudes, rates=(0.7,) * 6, factor=1.0):
    """Log of the arm, whose joints swing at some rates [Hz]; commands are off by a factor."""
    w, sizes = 2 * np.pi * np.array(rates), np.array(amplitudes)
    angle = w * TIME[:, None]
    q, dq = HOME + sizes * np.sin(angle), sizes * w * np.cos(angle)
    ddq = -sizes * w**2 * np.sin(angle)
    u = inverse_dynamics(robot.tree, q, dq, ddq) / RATIO + RATIO * np.array(rotors) * ddq
    names = [f"joint_{k + 1}" for k in range(6)]
    q = q + 2e-5 * np.random.default_rng(0).standard_normal(q.shape)
    return Record(time=TIME, q=q, u=factor * (u + 0.1 * dq), joints=names, robot=robot,
                  units={"u": ["N m"] * 6})


def test_a_joint_that_others_push_is_not_said_to_have_another_inertia(stated):
    rotors = [HEAVY, *[LIGHT] * 5]
    robot = stated(rotors)
    record = logged(robot, rotors, [0.01, *[0.4] * 5])
    assert check_scale(record, robot) == []
    assert np.isnan(inertia_ratios(record, robot)).all()


def test_the_weight_of_a_link_that_another_joint_turns_is_no_inertia(tmp_path):
    """Slow motion of a planar arm shows the weight of its second link most."""
    arm = Arm(np.array([0.9, 0.6]), np.array([0.3, 0.25]), np.array([0.1, 0.015]),
              np.array([0.3, 0.05]), np.ones(2), has_gravity=True)
    file = tmp_path / "robot.toml"
    file.write_text("joints = 2\n[motor]\ngear_ratio = [1, 1]\ninertia_kgm2 = [0.1, 0.015]\n"
                    "viscous_friction_nms = [0.3, 0.05]\n[links]\nmass_kg = [0.9, 0.6]\n"
                    "length_m = [0.3, 0.25]\ncom_m = [0.15, 0.125]\n"
                    f"inertia_kgm2 = {arm.spin.tolist()}\n[nominal]\ngravity = true\n"
                    "[controller]\nKp = [50, 5]\nKd = [5, 0.5]\n")
    robot, motion = read_robot(file), Reference(np.random.default_rng(5), 2, 1.2)
    q, dq, ddq = np.swapaxes([motion(t) for t in TIME], 0, 1)
    terms = [arm.terms(*state) for state in zip(q, dq)]
    u = np.array([mass @ a + bias for (mass, bias), a in zip(terms, ddq)])
    q = q + 2e-5 * np.random.default_rng(0).standard_normal(q.shape)
    record = Record(time=TIME, q=q, u=u, joints=["joint1", "joint2"], robot=robot,
                    units={"u": ["N m"] * 2})
    assert inertia_ratios(record, robot)[1] == pytest.approx(1.0, abs=0.2)
    assert check_scale(record, robot) == []


def test_commands_in_another_unit_show_another_inertia(stated):
    rotors = [HEAVY] * 6
    robot = stated(rotors)
    apart = {"amplitudes": [0.3] * 6, "rates": (0.5, 0.6, 0.7, 0.83, 0.97, 1.1)}
    assert check_scale(logged(robot, rotors, **apart), robot) == []
    (finding,) = check_scale(logged(robot, rotors, **apart, factor=1e3), robot)
    assert finding.check == "units.inertia" and "mN m" in finding.what


def test_another_log_with_the_stated_inertia_excuses_what_is_no_unit(stated):
    rotors = [HEAVY] * 6
    robot = stated(rotors)
    apart = {"amplitudes": [0.3] * 6, "rates": (0.5, 0.6, 0.7, 0.83, 0.97, 1.1)}
    sound = logged(robot, rotors, **apart)
    heavy, other_unit, far = (logged(robot, rotors, **apart, factor=factor)
                              for factor in (4.0, 1e3, 30.0))
    assert [one.check for one in check_scale(heavy, robot)] == ["units.inertia"]
    assert check_scale(heavy, robot, [sound]) == []
    assert check_scale(heavy, robot, [heavy])
    assert check_scale(other_unit, robot, [sound]) and check_scale(far, robot, [sound])
