"""What the column u holds decides what drives the models, and what can be named."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.drive import TORQUE_GAIN_ERROR
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.fitting.hypothesis import (
    TORQUE_SCALE,
    build_hypothesis,
    held_members,
)
from clie_blocks.analysis.gap.problem.preparation import prepare
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal
from clie_blocks.errors import NotIdentifiableError, RecordError

TIME = 0.005 * np.arange(800)
Q, QD = np.sin(TIME)[:, None], np.sin(TIME + 0.1)[:, None]
PD = Controller(law="pd", kp=[10.0], kd=[1.0], velocity_filter="difference", sample_time=0.005)
U = 10.0 * (QD - Q) - np.concatenate([[[0.0]], np.diff(Q, axis=0)]) / 0.005


def robot_with(u_is, law=PD):
    return Robot(n=1, controller=dataclasses.replace(law, u_is=u_is))


def stated(robot, **signals):
    return Problem.from_logs(robot, [Record(time=TIME, q=Q, robot=robot, **signals)],
                             trust_logs=True)


@pytest.mark.parametrize("written, read", [
    ('u_is = "measured"', "measured"), ('u = "measured torque"', "measured"),
    ('u_is = "computed"', "computed"), ('u = "command"', "commanded")])
def test_the_robot_file_says_what_u_is(tmp_path, written, read):
    path = tmp_path / "robot.toml"
    path.write_text(f"joints = 1\n[controller]\n{written}\n")
    assert read_robot(path).controller.u_is == read


def test_a_word_that_says_nothing_of_u_is_refused_with_the_nearest(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text('joints = 1\n[controller]\nu_is = "mesured"\n')
    with pytest.raises(RecordError, match="measured"):
        read_robot(path)


def test_a_measured_torque_needs_no_law_and_shows_no_drive():
    problem = stated(robot_with("measured"), qd=QD, u=1.1 * U)
    assert not problem.law.holds_joints
    np.testing.assert_array_equal(problem.logs[0].pe, 1.1 * U)
    assert not problem.law.reaches(TORQUE_GAIN_ERROR) and problem.law.reaches(COULOMB)
    assert "the law is left out" in " ".join(problem.records[0].decisions)


def test_a_computed_torque_is_not_read():
    problem = stated(robot_with("computed"), qd=QD, u=7.0 * U)
    np.testing.assert_allclose(problem.logs[0].u, U, atol=1e-12)
    assert "it is no measurement" in " ".join(problem.records[0].decisions)
    unknown = robot_with("computed", Controller(law="unknown"))
    (record,) = prepare(unknown, [Record(time=TIME, q=Q, qd=QD, u=U, robot=unknown)])[1]
    np.testing.assert_allclose(record.u, QD - Q)


def test_a_stated_law_gives_the_commands_that_were_not_logged():
    problem = stated(robot_with(None), qd=QD)
    np.testing.assert_allclose(problem.logs[0].u, U, atol=1e-12)
    with pytest.raises(NotIdentifiableError, match="neither a command u nor a reference"):
        stated(robot_with(None))


@pytest.mark.parametrize("sign, driven", [(1.0, True), (0.0, False)])
def test_a_torque_drives_the_model_before_a_reference_does_if_it_has_a_sign(sign, driven):
    robot = robot_with(None, Controller(law="unknown"))
    tau = U if sign else np.abs(U)
    ready, (record,) = prepare(robot, [Record(time=TIME, q=Q, qd=QD, tau=tau, robot=robot)])
    assert (ready.controller.u_is == "measured") == driven
    np.testing.assert_allclose(record.u, tau if driven else QD - Q)
    assert ("never changes its sign" in " ".join(record.decisions)) != driven


def test_a_torque_constant_is_as_uncertain_as_every_mass_and_friction_beside_it():
    robot = Robot(n=1, controller=PD, links=Links(mass=[1.0], length=[0.3], com=[0.2]),
                  motor=Motor(inertia=[0.1], viscous_friction=[0.2], inertia_tolerance=0.05,
                              viscous_friction_tolerance=0.1))
    loose = dataclasses.replace(robot, motor=dataclasses.replace(
        robot.motor, torque_constant_tolerance=0.2))
    tight, wide = (stated(one, qd=QD, u=U).nominal for one in (robot, loose))
    assert tight.mass_tolerance == 0.0 and wide.mass_tolerance == pytest.approx(0.2)
    np.testing.assert_allclose(wide.inertia_tolerance**2 - tight.inertia_tolerance**2,
                               (0.2 * tight.inertia) ** 2)
    np.testing.assert_allclose(wide.damping_tolerance**2 - tight.damping_tolerance**2,
                               (0.2 * tight.damping) ** 2)


def test_coupling_or_weight_tell_a_torque_constant_from_masses():
    weighing = Robot(n=1, controller=PD, nominal=Nominal(gravity=True),
                     links=Links(mass=[1.0], length=[0.3], com=[0.2]),
                     motor=Motor(inertia=[0.1], viscous_friction=[0.2], inertia_tolerance=0.05,
                                 viscous_friction_tolerance=0.1, torque_constant_tolerance=0.2))
    problem = stated(weighing, qd=QD, u=U)
    tight = stated(dataclasses.replace(weighing, motor=dataclasses.replace(
        weighing.motor, torque_constant_tolerance=None)), qd=QD, u=U).nominal
    assert problem.nominal.torque_tolerance == 0.2 and problem.nominal.mass_tolerance == 0.0
    np.testing.assert_array_equal(problem.nominal.inertia_tolerance, tight.inertia_tolerance)
    torque, = held_members(problem)
    assert torque.cause.name == "torque_gain_error" and torque.joints == (0,)
    free = build_hypothesis(problem, ()).free_parameters
    scale, = (one for one in free if one.key == TORQUE_SCALE)
    assert (scale.centre, scale.tolerance) == (0.0, 0.2)
