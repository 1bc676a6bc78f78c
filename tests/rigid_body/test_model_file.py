"""Models as robot files name them: joints that count as logs do, loads, gravity, bad input."""

from pathlib import Path

import numpy as np
import pytest

from clie_blocks.errors import ClieError
from clie_blocks.rigid_body.dynamics import gravity_torque, inverse_dynamics, mass_matrix
from clie_blocks.rigid_body.model_file import read_model

ARM = Path(__file__).parents[2] / "docs" / "arms" / "six_axis.urdf"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


def test_signs_and_zeros_count_positions_as_the_logs_do():
    sign, zero = np.array([1, -1, 1, -1, 1, 1.0]), np.array([0.0, 0.4, -1.0, 0.0, 2.0, 0.3])
    plain = read_model(ARM, tip="flange")
    logged = read_model(ARM, tip="flange", joints=JOINTS, sign=sign, zero=zero)
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 20, 6))
    expected = sign * inverse_dynamics(plain, sign * q + zero, sign * dq, sign * ddq)
    torque = inverse_dynamics(logged, q, dq, ddq)
    np.testing.assert_allclose(torque, expected, atol=1e-11 * np.abs(expected).max())


def test_a_sliding_joint_is_counted_from_its_zero(tmp_path):
    path = tmp_path / "gantry.urdf"
    path.write_text("""<robot name="gantry"><link name="base"/>
        <link name="beam"><inertial><mass value="2"/><origin xyz="0.1 0 0"/>
          <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="slide"><inertial><mass value="1"/>
          <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="turn" type="continuous"><parent link="base"/><child link="beam"/>
          <axis xyz="0 1 0"/></joint>
        <joint name="slide" type="prismatic"><parent link="beam"/><child link="slide"/>
          <axis xyz="1 0 0"/></joint></robot>""")
    plain, logged = read_model(path), read_model(path, zero=[0.0, 0.3], sign=[1.0, -1.0])
    q = np.array([0.2, 0.1])
    moved = mass_matrix(plain, np.array([0.2, 0.3 - 0.1]))
    np.testing.assert_allclose(mass_matrix(logged, q), moved * [[1, -1], [-1, 1]], atol=1e-12)


def test_a_payload_is_a_point_mass_at_the_tip():
    plain, loaded = (read_model(ARM, tip="flange", payload=mass) for mass in (0.0, 3.0))
    q, step = np.array([0.3, -1.0, 1.2, -0.5, -1.5, 0.2]), 1e-6
    more = gravity_torque(loaded, q) - gravity_torque(plain, q)
    rise = [(_height(plain, q + h) - _height(plain, q - h)) / (2 * step)
            for h in step * np.eye(6)]
    np.testing.assert_allclose(more, 3.0 * 9.81 * np.array(rise), atol=1e-6)
    assert loaded.mass.sum() == pytest.approx(plain.mass.sum() + 3.0)


def _height(links, q):
    """Height of the tip [m], from the frames of the joints."""
    from clie_blocks.rigid_body.dynamics import poses

    turn, place = poses(links, list(q))[-1]
    return place[2] + np.dot(turn[2], links.tip)


def test_a_right_angle_that_the_file_rounds_is_one():
    links = read_model(ARM, tip="flange")
    assert np.isin(links.rotation, (-1.0, 0.0, 1.0)).all()


def test_gravity_turns_with_the_mounting():
    upright = read_model(ARM, tip="flange")
    hanging = read_model(ARM, tip="flange", gravity=(0.0, 0.0, 9.81))
    q = np.linspace(-1.0, 1.0, 6)
    np.testing.assert_allclose(gravity_torque(hanging, q), -gravity_torque(upright, q))


@pytest.mark.parametrize(("how", "message"), [
    ({"joints": ("elbow", "wrist_1")}, "joint 'shoulder_pan' moves, and no log holds it"),
    ({"joints": (*JOINTS[:5], "wrist3")}, "no joint 'wrist3' that moves.*wrist_3"),
    ({"joints": JOINTS[::-1]}, "'wrist_3' is listed before 'wrist_2'.*from the base outwards"),
    ({"sign": [1, 1, 2, 1, 1, 1]}, "sign of joint 'elbow' is 2"),
    ({"zero": [0.0, 0.0]}, "6 joints move, and zero has 2 entries"),
    ({"tip": "flnge"}, "no link 'flnge'.*flange"),
    ({"locked": {"elbo": 0.0}}, "no joint 'elbo' to lock.*elbow"),
])
def test_what_does_not_fit_the_model_is_named(how, message):
    with pytest.raises(ClieError, match=message):
        read_model(ARM, **{"tip": "flange", **how})


def test_a_xacro_file_is_refused_with_the_command_that_expands_it(tmp_path):
    with pytest.raises(ClieError, match="xacro robot.xacro > robot.urdf"):
        read_model(tmp_path / "arm.xacro")
