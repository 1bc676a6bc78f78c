"""What one unit of a command is worth in N m or N."""

import numpy as np
import pytest

from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.command_unit import force_per_command, missing_force
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Motor

TIME = np.arange(3.0)


def record(unit, q="rad", **motor):
    """Record of one joint whose command is in a unit."""
    zero = np.zeros((3, 1))
    return Record(time=TIME, q=zero, u=zero, units={"u": unit, "q": q},
                  robot=Robot(n=1, motor=Motor(**motor)))


@pytest.mark.parametrize("unit, motor, force", [
    ("N m", {}, 1.0), ("N m", {"torque_gain": 0.9}, 0.9), ("N", {}, 1.0),
    ("A", {"torque_constant": 0.12}, 0.12), ("V", {"torque_gain": 35.15}, 35.15),
    ("V", {"torque_constant": 0.1, "resistance": 2.0}, 0.05), ("%", {"torque_gain": 0.7}, 0.7),
    ("u", {"torque_gain": 3.0}, 3.0)])
def test_the_robot_file_says_what_a_command_is_worth(unit, motor, force):
    stated = record(unit, **motor)
    assert force_per_command(stated) == pytest.approx([force])
    assert missing_force(stated) is None


@pytest.mark.parametrize("unit, motor, remedy", [
    ("A", {}, "torque_constant_nm_a"), ("V", {"torque_constant": 0.1}, "resistance_ohm"),
    ("%", {}, "torque per percent"), ("%", {"torque_gain": 1.0}, "torque per percent"),
    ("duty", {}, "supply_v"), ("u", {}, '[units] u = "N m"'), ("rad", {}, "log the command")])
def test_without_it_the_remedy_is_named(unit, motor, remedy):
    stated = record(unit, **motor)
    assert force_per_command(stated) is None
    assert remedy in missing_force(stated)


def test_a_position_in_percent_has_no_torque():
    assert "neither an angle nor a length" in missing_force(record("N m", q="%"))
