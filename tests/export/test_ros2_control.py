"""ROS 2: the chainable controller gives the numbers of the block, in a whole package."""

from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.errors import ClieError
from tests.export import robots
from tests.export.stand_ins import compiled, needs_cxx, pointer
from tests.export.test_cores import STEP, expected, signals

EFFECTS = ("stribeck", "actuator_lag", "torque_ripple", "load_dependent_friction")


@needs_cxx
def test_the_controller_gives_the_numbers_of_the_block_at_its_own_rate_alone(tmp_path, capfd):
    correction = robots.of_links(*map(robots.setting, EFFECTS), gear=2.0, gain=1.1,
                                 before={"gear": 2.0, "gain": 1.0})
    exported = export(correction, "ros2-control")
    exported.save(tmp_path)
    code = compiled(tmp_path, "j1_controller.cpp", "ros2_run.cc", "ros2.hpp")
    rows = np.ascontiguousarray(signals(60))
    wanted = expected(core(joint_block(correction, 0, STEP)), rows * [1.0, 1.0, 0.5, 1.0])[:, 0]
    effort = np.zeros(60)
    assert code.run(60, 1000, pointer(rows), pointer(effort)) == 0
    np.testing.assert_allclose(effort, wanted, rtol=1e-12, atol=1e-12)
    assert any("2 times the logged command" in note and "command_per_effort" in note
               for note in exported.notes)
    assert code.run(60, 500, pointer(rows), pointer(effort)) == 2
    assert "set update_rate to 1000" in capfd.readouterr().err


def test_the_package_is_one_of_all_joints():
    yaml = pytest.importorskip("yaml", reason="needs pyyaml")
    both = Correction((robots.joint(), robots.joint(name="roll", gear=2.0)), 1e-3,
                      (robots.setting("stribeck"),))
    files = export(both, "ros2-control", renamed={"roll": "wrist/roll"}).files
    plugins = ElementTree.fromstring(files["corrected_joints.xml"])
    assert [one.get("type") for one in plugins] == [
        "corrected_joints::J1Controller", "corrected_joints::WristRollController"]
    assert ElementTree.fromstring(files["package.xml"]).findtext("name") == "corrected_joints"
    assert "wrist_roll_controller.cpp wrist_roll.c" in files["CMakeLists.txt"]
    told = yaml.safe_load(files["controllers.yaml"])
    assert told["controller_manager"]["ros__parameters"] == {
        "update_rate": 1000, "j1_corrected": {"type": "corrected_joints/J1Controller"},
        "wrist_roll_corrected": {"type": "corrected_joints/WristRollController"}}
    assert told["wrist_roll_corrected"]["ros__parameters"] == {
        "joint": "wrist/roll", "command_per_effort": 1.0}
    with pytest.raises(ClieError, match="1428.57 Hz; give the step"):
        export(robots.correction(), "ros2-control", step=0.0007)


def test_joints_that_are_called_alike_in_code_are_refused():
    both = Correction((robots.joint(name="j_1"), robots.joint(name="j1")), 1e-3, ())
    with pytest.raises(ClieError, match="'j_1' and 'j1' have the same name in code, J1"):
        export(both, "ros2-control")
    assert export(both, "ros2-control", renamed={"j1": "second"}).files
