"""Commands that are no torque, beside a datasheet in SI."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.robot_sections import Links, Nominal
from clie_blocks.errors import RecordError
from tests.gap import one_joint

CONSTANT = 0.12  # N m/A
TIME = 1e-3 * np.arange(2000)


def in_unit(unit, factor, law=True, **motor):
    """Robot and log of the one joint with commands in a unit, and what is known of that.

    The command belongs to no motion, so that the log is to be trusted.
    """
    robot = one_joint.robot()
    control = dataclasses.replace(robot.controller, kp=robot.controller.kp / factor,
                                  kd=robot.controller.kd / factor)
    robot = dataclasses.replace(
        robot, controller=control, motor=dataclasses.replace(robot.motor, **motor))
    q = 0.5 * np.sin(TIME)[:, None]
    u = (one_joint.KP * (0.0 - q) + np.cos(3.0 * TIME)[:, None]) / factor
    return robot, Record(time=TIME, q=q, u=u, qd=0.0 * q, pe=0.0 * q, robot=robot,
                         units={"u": unit, "pe": unit})


@pytest.mark.parametrize("unit, factor, motor", [
    ("A", CONSTANT, {"torque_constant": [CONSTANT]}), ("V", 2.5, {"torque_gain": [2.5]}),
    ("%", 0.05, {"torque_gain": [0.05]})])
def test_a_command_of_known_worth_becomes_the_torque(unit, factor, motor):
    robot, record = in_unit(unit, factor, **motor)
    problem, plain = (Problem.from_logs(one, [log], trust_logs=True)
                      for one, log in ((robot, record), in_unit("N m", 1.0)))
    assert problem.records[0].units["u"] == problem.records[0].units["pe"] == ("N m",)
    np.testing.assert_allclose(problem.logs[0].u, plain.logs[0].u, rtol=1e-12)
    np.testing.assert_allclose(problem.law.kp, plain.law.kp)
    np.testing.assert_allclose(problem.law.kd, plain.law.kd)
    assert problem.nominal.inertia == pytest.approx(plain.nominal.inertia)
    assert f"{factor:g} N m per {unit} at joint1" in problem.records[0].decisions[-1]


def test_without_its_worth_the_datasheet_is_not_compared():
    robot, record = in_unit("%", 0.05)
    problem = Problem.from_logs(robot, [record], trust_logs=True)
    assert problem.records[0].units["u"] == ("%",)
    np.testing.assert_array_equal(problem.logs[0].u, record.u)
    assert problem.nominal.inertia_tolerance == pytest.approx(10.0 * problem.nominal.inertia)
    assert "cannot be compared with u" in problem.records[0].decisions[-1]
    assert "torque_gain" in problem.records[0].decisions[-1]


def test_known_weight_and_a_command_of_unknown_worth_are_refused_with_the_remedy():
    robot, record = in_unit("%", 0.05)
    heavy = dataclasses.replace(
        robot, links=Links(length=[0.5], mass=[1.0], com=[0.25], inertia=[0.02]),
        nominal=Nominal(gravity=True))
    with pytest.raises(RecordError, match=r"in %, not a torque: state \[motor\] torque_gain"):
        Problem.from_logs(heavy, [record.replace(robot=heavy)], trust_logs=True)
