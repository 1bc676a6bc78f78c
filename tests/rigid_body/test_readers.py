"""Robot descriptions: read here and by MuJoCo, and refused where they are none."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from peer import Peer
from random_trees import mjcf, random_bodies

from clie_blocks.errors import ClieError
from clie_blocks.rigid_body.dynamics import gravity_torque, inverse_dynamics
from clie_blocks.rigid_body.mjcf import read_mjcf
from clie_blocks.rigid_body.solids import SOLIDS, solid
from clie_blocks.rigid_body.urdf import read_urdf

INERTIAL = ('<inertial><origin xyz="0.1 0.02 0" rpy="0.3 0.2 0.1"/><mass value="{mass}"/><inertia '
            'ixx="0.03" iyy="0.04" izz="0.05" ixy="0.002" ixz="0.001" iyz="0"/></inertial>')
URDF = f"""<robot name="arm">
<link name="base"/>
<link name="upper">{INERTIAL.format(mass=2)}</link>
<link name="sensor">{INERTIAL.format(mass=0.5)}</link>
<link name="lower">{INERTIAL.format(mass=1)}</link>
<link name="slide">{INERTIAL.format(mass=0.7)}</link>
<link name="hand"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0 0 0.3" rpy="1.5708 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="2"/></joint>
<joint name="mount" type="fixed"><parent link="upper"/><child link="sensor"/>
  <origin xyz="0.2 0 0.1" rpy="0.5 0 1"/></joint>
<joint name="j2" type="continuous"><parent link="sensor"/><child link="lower"/>
  <origin xyz="0.1 0.2 0" rpy="0 0.4 0"/><axis xyz="1 1 0"/></joint>
<joint name="j3" type="prismatic"><parent link="lower"/><child link="slide"/>
  <origin xyz="0.1 0 0" rpy="0 0.4 0"/><axis xyz="0 0 -1"/><limit lower="0" upper="0.2"/></joint>
<joint name="flange" type="fixed"><parent link="slide"/><child link="hand"/></joint>
</robot>"""

MJCF = """<mujoco model="arm"><compiler angle="degree" eulerseq="zyx"/>
<option gravity="0 0.5 -9.7"/>
<default><joint axis="0 1 0" damping="0.1"/><geom density="2000"/>
  <default class="upper"><joint axis="1 0 0"/><geom type="capsule" size="0.04 0.1"/></default>
</default>
<worldbody><geom type="plane" size="1 1 1"/>
<body name="b1" pos="0 0 0.3" euler="10 20 30">
  <joint name="j1" axis="0 0 1" pos="0.01 0.02 0"/>
  <geom type="box" size="0.1 0.05 0.02" pos="0.1 0 0"/>
  <frame pos="0.1 0 0" axisangle="0 1 0 40">
    <geom type="cylinder" size="0.03 0.2" quat="1 0.2 0.3 0"/>
    <body name="b2" pos="0.2 0 0.1" quat="1 0.1 0.2 0.3" childclass="upper">
      <joint name="j2" ref="15" range="-90 90"/><geom fromto="0 0 0 0.1 0.2 0.3"/>
      <body name="bump" pos="0.1 0.1 0"><geom type="ellipsoid" size="0.05 0.1 0.02"/></body>
      <body name="b3" pos="0.1 0.1 0.2" zaxis="1 1 0">
        <joint name="j3" type="slide" axis="0 1 1"/>
        <joint name="j4" axis="0 1 0" pos="0 0.05 0.1"/>
        <inertial mass="1.5" pos="0.02 0.01 0.1" quat="1 0.1 0 0" diaginertia="0.02 0.03 0.04"/>
        <body name="b4" pos="0.1 0 0" xyaxes="1 1 0 -1 1 0"><joint name="j5" class="main"/>
          <inertial mass="0.5" pos="0.02 0.01 0.1"
            fullinertia="0.02 0.03 0.04 0.001 0.002 0.003"/></body>
      </body>
    </body>
  </frame>
  <body name="c1" pos="-0.2 0 0"><joint name="k1" type="slide"/>
    <geom type="sphere" size="0.05" mass="0.3"/></body>
</body></worldbody></mujoco>"""


def assert_alike(links, path):
    peer = Peer(mujoco.MjModel.from_xml_path(str(path)), links.names)
    for q, dq, ddq in np.random.default_rng(0).normal(size=(5, 3, links.n)):
        torque = peer.inverse_dynamics(q, dq, ddq)
        np.testing.assert_allclose(inverse_dynamics(links, q, dq, ddq), torque, rtol=0,
                                   atol=1e-12 * max(1.0, np.abs(torque).max()))


def written(folder, text, name="arm.xml"):
    path = folder / name
    path.write_text(text)
    return path


def test_a_urdf_is_read_as_mujoco_reads_it(tmp_path):
    path = written(tmp_path, URDF)
    links = read_urdf(path)
    assert links.names == ("j1", "j2", "j3") and links.slides == (False, False, True)
    assert_alike(links, path)
    np.testing.assert_allclose(links.lower, [-1.0, -np.inf, 0.0])


def test_an_mjcf_is_read_as_mujoco_reads_it(tmp_path):
    path = written(tmp_path, MJCF)
    links = read_mjcf(path)
    assert links.names == ("j1", "j2", "j3", "j4", "j5", "k1")
    assert_alike(links, path)
    np.testing.assert_allclose(links.upper[1], np.pi / 2)


def test_what_mujoco_writes_is_read(tmp_path):
    model = mujoco.MjModel.from_xml_path(str(written(tmp_path, MJCF)))
    saved = tmp_path / "saved.xml"
    mujoco.mj_saveLastXML(str(saved), model)
    assert_alike(read_mjcf(saved), saved)


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_random_trees_survive_their_file(tmp_path_factory, seed):
    path = written(tmp_path_factory.mktemp("tree"), mjcf(random_bodies(seed, 4, (1,))))
    assert_alike(read_mjcf(path), path)


def test_a_held_joint_is_one_that_does_not_move(tmp_path):
    path = written(tmp_path, URDF)
    whole, held = read_urdf(path), read_urdf(path, locked={"j2": 0.7})
    assert held.names == ("j1", "j3")
    q, dq, ddq = np.random.default_rng(1).normal(size=(3, 2))
    spread = [np.array([a, b, c]) for (a, c), b in zip((q, dq, ddq), (0.7, 0.0, 0.0))]
    np.testing.assert_allclose(inverse_dynamics(held, q, dq, ddq),
                               inverse_dynamics(whole, *spread)[[0, 2]], atol=1e-12)


def test_joints_off_the_way_to_the_tip_are_held_at_zero(tmp_path):
    path = written(tmp_path, URDF)
    assert read_urdf(path, tip="lower").names == ("j1", "j2")
    assert read_urdf(path, base="upper", tip="hand").names == ("j2", "j3")
    q = np.array([0.3, 0.4])
    np.testing.assert_allclose(gravity_torque(read_urdf(path, tip="lower"), q),
                               gravity_torque(read_urdf(path), np.append(q, 0.0))[:2])


@pytest.mark.parametrize("old, new, says", [
    ("robot", "mujoco", "begins with <mujoco>"),
    ('<link name="base"/>', '<!DOCTYPE x [<!ENTITY a "b">]><link name="base"/>', "entities"),
    ('<link name="base"/>', '<link name="bse"/>', "did you mean 'bse'"),
    ('type="continuous"', 'type="revolut"', "did you mean 'revolute'"),
    ('type="continuous"', 'type="floating"', "moves freely"),
    ('<axis xyz="1 1 0"/>', '<axis xyz="1 1"/>', "3 finite numbers"),
    ('<axis xyz="1 1 0"/>', '<axis xyz="0 0 0"/>', "no direction"),
    ('<axis xyz="1 1 0"/>', '<mimic joint="j1"/>', "follows 'j1'"),
    ('<mass value="2"/>', '<mass value="-2"/>', "mass of link 'upper'"),
    ('<mass value="2"/>', '<mass value="nan"/>', "finite number"),
    ('izz="0.05"', 'izz="0.5"', "belong to no body"),
    ('ixx="0.03"', 'ixx="-0.03"', "no moment is negative"),
    ('<child link="hand"/>', '<child link="lower"/>', "carried by joints"),
    ('<child link="hand"/>', '<child link="base"/>', "carry each other"),
    ("</robot>", '<xacro:macro name="x"/></robot>', "run: xacro"),
    ("</robot>", "", "is no XML"),
])
def test_a_urdf_that_is_none_is_refused_with_the_remedy(tmp_path, old, new, says):
    assert old in URDF
    path = written(tmp_path, URDF.replace(old, new))
    with pytest.raises(ClieError, match=says):
        read_urdf(path)


@pytest.mark.parametrize("asked, says", [
    ({"tip": "hands"}, "did you mean 'hand'"), ({"base": "bas"}, "did you mean 'base'"),
    ({"locked": {"j": 0.0}}, "no joint 'j' to lock"),
    ({"base": "lower", "tip": "sensor"}, "is not carried by 'lower'"),
    ({"tip": "base"}, "at least one joint that moves")])
def test_names_that_are_not_there_are_answered_with_the_nearest(tmp_path, asked, says):
    with pytest.raises(ClieError, match=says):
        read_urdf(written(tmp_path, URDF), **asked)


@pytest.mark.parametrize("old, new, says", [
    ("<worldbody>", '<include file="x.xml"/><worldbody>', "mj_saveLastXML"),
    ('class="main"', 'class="man"', "did you mean 'main'"),
    ('type="slide" axis="0 1 1"', 'type="ball"', "no single motor drives"),
    ('type="slide" axis="0 1 1"', 'type="slid"', "did you mean 'slide'"),
    ('type="box"', 'type="mesh"', "give the body an <inertial>"),
    ('size="0.1 0.05 0.02"', 'size="0.1 0.05"', "3 positive"),
    ('name="b2"', 'name="b1"', "two bodies are called 'b1'"),
    ("</mujoco>", '<equality><joint joint1="j2" joint2="j1"/></equality></mujoco>', "<equality>"),
    ("</mujoco>", '<equality><weld body1="b1" body2="b2"/></equality></mujoco>', "closes a loop"),
    ('angle="degree"', 'angle="degree" settotalmass="3"', "changes masses"),
])
def test_an_mjcf_that_holds_no_tree_is_refused_with_the_remedy(tmp_path, old, new, says):
    assert old in MJCF
    with pytest.raises(ClieError, match=says):
        read_mjcf(written(tmp_path, MJCF.replace(old, new, 1)))


def test_no_file_and_a_huge_one_are_refused(tmp_path, monkeypatch):
    with pytest.raises(ClieError, match="is no file"):
        read_urdf(tmp_path / "none.urdf")
    monkeypatch.setattr("clie_blocks.rigid_body.xml_file.LARGEST_FILE", 100)
    with pytest.raises(ClieError, match="without its meshes"):
        read_urdf(written(tmp_path, URDF))


INSIDE = {  # solids of size 0.3, 0.2, 0.1
    "sphere": lambda x, y, z: x**2 + y**2 + z**2 < 0.3**2,
    "capsule": lambda x, y, z: np.hypot(np.hypot(x, y), np.maximum(np.abs(z) - 0.2, 0)) < 0.3,
    "cylinder": lambda x, y, z: (np.hypot(x, y) < 0.3) & (np.abs(z) < 0.2),
    "ellipsoid": lambda x, y, z: (x / 0.3)**2 + (y / 0.2)**2 + (z / 0.1)**2 < 1.0,
    "box": lambda x, y, z: (np.abs(x) < 0.3) & (np.abs(y) < 0.2) & (np.abs(z) < 0.1)}


@pytest.mark.parametrize("kind", SOLIDS)
def test_moments_of_solids_are_those_of_their_points(kind):
    """Second route: the mean over points drawn inside."""
    size = np.array([0.3, 0.2, 0.1])[:SOLIDS[kind]]
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (3, 2_000_000))
    inside = INSIDE[kind](*points)
    volume, moments = solid(kind, size)
    assert inside.mean() == pytest.approx(volume, rel=0.01)
    square = (points[:, inside] ** 2).mean(axis=1)
    np.testing.assert_allclose(square.sum() - square, moments, rtol=0.01)
