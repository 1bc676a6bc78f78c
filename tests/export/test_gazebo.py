"""Gazebo: the system gives the numbers of the block, and the user's SDF is patched."""

import ctypes
from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.errors import ClieError, RecordError
from tests.export import robots
from tests.export.stand_ins import compiled, needs_cxx, pointer
from tests.export.test_cores import STEP, expected, signals

EFFECTS = ("stribeck", "actuator_lag", "torque_ripple")
OWN = """<?xml version="1.0"?>
<!-- The bench, by hand. -->
<sdf version="1.10">
  <world name="bench">
    <physics name="1ms" type="ignored"><max_step_size>0.001</max_step_size></physics>
    <model name="arm">
      <link name="upper"/>
      <joint name='j1'   type="revolute">  <!-- the elbow -->
        <axis>
          <xyz>0 1 0</xyz>
          <dynamics>
            <damping>0.7</damping>   <!-- guessed -->
            <spring_stiffness>2</spring_stiffness>
          </dynamics>
        </axis>
      </joint>
      <plugin filename="gz-sim-apply-joint-force-system"
              name="gz::sim::systems::ApplyJointForce"/>
    </model>
  </world>
</sdf>
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    """Exit code, and force after each step, of the system on rows against the stand-in."""
    folder = tmp_path_factory.mktemp("gazebo")
    export(robots.correction(*map(robots.setting, EFFECTS)), "gazebo", step=STEP).save(folder)
    code = compiled(folder, "j1_gazebo.cc", "gazebo_run.cc", "gazebo.hh")

    def run(rows, every, joint="elbow", per_force="1"):
        rows, force = np.ascontiguousarray(rows[:, :3]), np.zeros(len(rows))
        rc = code.run(len(rows), ctypes.c_double(every), joint.encode(), per_force.encode(),
                      pointer(rows), pointer(force))
        return rc, force

    return run


def rows_of(count):
    """Inputs of the block without what else acts on the joint, which Gazebo does not tell."""
    return signals(count) * [1.0, 1.0, 1.0, 0.0]


@needs_cxx
def test_the_system_gives_the_numbers_of_the_block_and_holds_them_between_its_steps(system):
    correction = robots.correction(*map(robots.setting, EFFECTS))
    wanted = expected(core(joint_block(correction, 0, STEP)), rows_of(60))[:, 0]
    rc, force = system(rows_of(60).repeat(2, 0), STEP / 2)
    assert rc == 0
    np.testing.assert_allclose(force[0::2], wanted, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(force[0::2], force[1::2])
    rc, halved = system(rows_of(60) * [1.0, 1.0, 2.0, 1.0], STEP, per_force="0.5")
    np.testing.assert_array_equal(halved, force[0::2])


@needs_cxx
def test_a_missing_joint_and_a_longer_step_are_said_once_and_leave_the_command_alone(system,
                                                                                     capfd):
    assert system(rows_of(5), STEP, joint="wrist")[0] == 1  # no component was made
    assert "The model has no joint wrist" in capfd.readouterr().err
    rc, force = system(rows_of(5), 3 * STEP)
    np.testing.assert_array_equal(force, rows_of(5)[:, 2])
    assert rc == 0 and capfd.readouterr().err.count("set <max_step_size>") == 1


def exported(tmp_path, *effects, text=OWN, renamed=None, step=None, **changes):
    """The export into an SDF."""
    own = tmp_path / "own.sdf"
    own.write_text(text)
    return export(robots.correction(*effects, **changes), "gazebo", own, renamed, step)


def test_all_else_of_the_sdf_stays_as_it_stands(tmp_path):
    found = exported(tmp_path, robots.setting("stribeck"))
    text = found.files["own.corrected.sdf"]
    removed, added = ([line[1:].strip() for line in found.diff.splitlines()
                       if line.startswith(sign) and not line.startswith(sign * 3)]
                      for sign in "-+")
    assert removed == ["<damping>0.7</damping>   <!-- guessed -->"]
    assert added == ["<damping>0</damping>   <!-- guessed -->",
                     '<plugin filename="j1_gazebo" name="corrected::J1">',
                     "<joint_name>j1</joint_name>", "</plugin>"]
    assert found.files["own.original.sdf"] == OWN and found.files["own.diff"] == found.diff
    (model,) = ElementTree.fromstring(text).iter("model")
    assert model[-1].get("name") == "corrected::J1"  # behind the plugins of the controller
    assert "#define J1_STEP 0.001\n" in found.files["j1.h"]


def test_plain_coulomb_friction_is_the_joints_own(tmp_path):
    """The engine holds a joint at rest, which a block that does not see the load cannot."""
    found = exported(tmp_path, robots.setting("coulomb"), torque=3.0)
    root = ElementTree.fromstring(found.files["own.corrected.sdf"])
    assert float(root.find(".//dynamics/friction").text) == pytest.approx(0.3)
    assert "coulomb" not in found.files["j1.c"]
    bare = OWN[:OWN.index("<dynamics>")] + OWN[OWN.index("</dynamics>") + 11:]
    text = exported(tmp_path, robots.setting("coulomb"), text=bare).files["own.corrected.sdf"]
    assert float(ElementTree.fromstring(text).find(".//dynamics/friction").text) == 0.1
    with_gear = exported(tmp_path, robots.setting("coulomb"), robots.setting("backlash"))
    assert "coulomb_level" in with_gear.files["j1.c"]


def test_a_force_that_is_no_logged_command_is_told(tmp_path):
    found = exported(tmp_path, gear=10.0, before={"gear": 10.0, "gain": 0.5})
    assert "<command_per_force>0.2</command_per_force>" in found.diff
    assert any("5 times the logged command" in note for note in found.notes)


@pytest.mark.parametrize("text, changes, message", [
    ("<mujoco/>", {}, "an MJCF, which --to mujoco patches"),
    ("<robot/>", {}, "gz sdf -p"),
    (OWN.replace("'j1'", "'j2'"), {}, "no joint 'j1'.*did you mean 'j2'"),
    (OWN.replace("'j1'", "'j2'").replace("<link", "<include><uri>arm.sdf</uri></include><link"),
     {}, r"without arm.sdf, which it includes"),
    (OWN, {"kind": "slide", "unit_q": "m"}, "of type 'revolute'.*slide in m, which is prismatic"),
    (OWN.replace('type="revolute"', 'type="fixed"'), {}, "of type 'fixed'"),
    (OWN.replace('<link name="upper"/>', '<model name="other"><joint name="j1" type="revolute"/>'
                 "</model>"), {}, "2 joints 'j1'.*--joint j1=MODEL::j1"),
    (OWN.replace("0.001", "0.0007"), {"step": 0.001}, "no whole number of them"),
    (OWN.replace("<axis>", "<!--").replace("</axis>", "-->").replace("<!-- guessed -->", ""),
     {}, "has no <axis>"),
])
def test_a_model_that_does_not_match_is_refused(tmp_path, text, changes, message):
    with pytest.raises(ClieError, match=message):
        exported(tmp_path, robots.setting("stribeck"), text=text, **changes)


def test_a_joint_that_is_there_twice_is_named_by_its_model_and_not_corrected_twice(tmp_path):
    two = OWN.replace('<link name="upper"/>', '<model name="other"><joint name="j1" '
                      'type="revolute"/></model>')
    found = exported(tmp_path, robots.setting("stribeck"), text=two, renamed={"j1": "arm::j1"})
    assert "<joint_name>j1</joint_name>" in found.diff
    with pytest.raises(ClieError, match="loads j1_gazebo already"):
        exported(tmp_path, text=found.files["own.corrected.sdf"], renamed={"j1": "arm::j1"})


def test_without_a_model_there_is_what_belongs_into_one():
    files = export(robots.correction(robots.setting("coulomb")), "gazebo").files
    root = ElementTree.fromstring(files["joints.sdf"])
    assert root.find(".//friction").text == "0.1"
    assert root.find("plugin").get("filename") == "j1_gazebo"
    assert "add_library(j1_gazebo SHARED j1_gazebo.cc j1.c)" in files["CMakeLists.txt"]


def test_what_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(RecordError, match="give the SDF of the robot"):
        export(robots.correction(), "gazebo", tmp_path / "none.sdf")
