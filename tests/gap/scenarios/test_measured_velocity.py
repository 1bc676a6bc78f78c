"""Robots of another engine whose law damps the velocity that the drive measures and logs."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from law_robots import (  # noqa: E402
    CARRIED,
    FRICTION,
    KD,
    PROGRAM,
    RIGHT,
    STATED_PD,
    STEP,
    Robot,
    cascade,
    pd,
    pid,
    pid_that_carries_friction,
    program_text,
)

from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.export.simulated_model import law_in_steps  # noqa: E402
from clie_blocks.analysis.gap.controller.check import check_controller  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import is_stable  # noqa: E402
from clie_blocks.errors import NotIdentifiableError  # noqa: E402

LAG = 5e-3  # s, ten times what the difference of two samples is late
SENSED = {"sensor_lag": LAG}


def exact(text):
    return text.replace('velocity_filter = "difference"', 'velocity_filter = "exact"')


@pytest.mark.slow
@pytest.mark.parametrize("robot, effect, answer", [
    (Robot(lambda: pid(60.0), exact(RIGHT["pid"])), "", "none"),
    (Robot(lambda: cascade(18.0, 1.7, 8.0),
           exact(RIGHT["cascade with a slower outer loop"]).replace("position_every = 4\n", "")),
     "", "none"),
    (Robot(pd, STATED_PD), "coulomb", "coulomb")], ids=["pid", "cascade", "pd, not stated"])
def test_the_lag_of_the_velocity_is_no_fault_of_the_robot(tmp_path, robot, effect, answer):
    dataclasses.replace(robot, options=SENSED).write(tmp_path, effect, logs=3)
    diagnosis = gap.diagnose(gap.read(tmp_path))
    assert answer in diagnosis.ranking[0].names
    assert not diagnosis.controller.unexplained


def own_law(lag=LAG, **wrong):
    """Robot under a law of the owner's that reads the velocity of the drive, with its program."""
    return Robot(lambda: pid_that_carries_friction(60.0), PROGRAM, program=program_text(**wrong),
                 options={"sensor_lag": lag})


@pytest.mark.parametrize("lag", [1e-6, LAG], ids=["at once", "behind a lag"])
def test_a_law_of_the_owner_gives_the_commands_on_the_logged_velocity(tmp_path, lag):
    own_law(lag).write(tmp_path, seconds=2.0)
    check = check_controller(gap.read(tmp_path, run_law=True))
    assert check.as_stated and np.all(check.replay_error < 0.4 * STEP)


def test_a_velocity_in_degrees_is_read_by_its_unit(tmp_path):
    own_law().write(tmp_path, seconds=2.0)
    for path in tmp_path.glob("*.csv"):
        head, table = path.read_text().split("\n", 1)
        rows = np.loadtxt(table.splitlines(), delimiter=",")
        rows[:, 4] = np.degrees(rows[:, 4])
        np.savetxt(path, rows, "%.12g", ",", header=head.replace("dq1", "dq1[deg/s]"), comments="")
    assert check_controller(gap.read(tmp_path, run_law=True)).as_stated


def test_an_exported_model_reads_what_models_form_without_the_noise_of_the_drive(tmp_path):
    own_law().write(tmp_path, seconds=2.0)
    problem = gap.read(tmp_path, run_law=True)
    log, in_steps = problem.logs[0], law_in_steps(problem, problem.logs[0])
    quiet = dataclasses.replace(log, of_drive={"dq": log.of_drive["dq"] - log.drive_dither})
    np.testing.assert_allclose([in_steps(i, q) for i, q in enumerate(log.law_q)],
                               problem.law.commands(quiet), atol=1e-4)


def test_wrong_numbers_of_such_a_law_are_found(tmp_path):
    own_law(kd=2.0, carried=0.0).write(tmp_path, seconds=2.0)
    check = check_controller(gap.read(tmp_path, run_law=True))
    assert {one.name: one.value for one in check.parameters} == {
        "kd": pytest.approx(KD, rel=1e-3), "carried": pytest.approx(CARRIED, rel=1e-2)}


def test_samples_without_the_velocity_do_not_count(tmp_path):
    own_law().write(tmp_path, seconds=2.0)
    for path in tmp_path.glob("*.csv"):
        lines = path.read_text().splitlines()
        lines[300:330] = [line.rpartition(",")[0] + "," for line in lines[300:330]]
        path.write_text("\n".join(lines) + "\n")
    problem = gap.read(tmp_path, run_law=True)
    assert all(np.count_nonzero(~log.measured) == 30 for log in problem.logs)
    assert check_controller(problem).as_stated


def test_a_law_that_reads_a_velocity_needs_it_in_each_log(tmp_path):
    own_law().write(tmp_path, seconds=2.0)
    path = tmp_path / "log-2.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    np.savetxt(path, table[:, :4], "%.10g", ",", header="time,q1,u1,qd1", comments="")
    with pytest.raises(NotIdentifiableError, match=r"log-2.csv: the law 'carrying' reads dq\[k\], "
                       "and the log has no dq.*column dq1.*form the velocity within the law"):
        gap.read(tmp_path, run_law=True)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [1e-6, LAG], ids=["at once", "behind a lag"])
def test_a_sound_robot_under_a_law_on_a_measured_velocity_is_sound(tmp_path, lag):
    own_law(lag).write(tmp_path)
    diagnosis = gap.diagnose(gap.read(tmp_path, run_law=True))
    answer = diagnosis.to_dict()
    assert diagnosis.verdict == "none" and diagnosis.controller.as_stated
    assert answer["gap_before"] == pytest.approx(answer["gap_floor"], rel=0.1)


@pytest.mark.slow
def test_friction_is_named_under_a_law_on_a_measured_velocity(tmp_path):
    own_law().write(tmp_path, "coulomb", logs=3)
    diagnosis = gap.diagnose(gap.read(tmp_path, run_law=True))
    first = diagnosis.to_dict()["effects"][0]
    assert first["effect"] == "coulomb" and diagnosis.controller.as_stated
    assert first["parameters"]["level"]["value"][0] == pytest.approx(FRICTION, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["", "coulomb"])
def test_a_law_that_pushes_the_joint_along_near_rest_hides_no_friction(tmp_path, effect):
    carried = 0.1  # N m: at rest 2 N m s/rad, more than the law and the bearings damp
    dataclasses.replace(own_law(carried=carried), law=lambda: pid_that_carries_friction(
        60.0, carried=carried)).write(tmp_path, effect, logs=3)
    problem = gap.read(tmp_path, run_law=True)
    assert is_stable(problem)
    assert gap.diagnose(problem).ranking[0].names[0] == (effect or "none")


@pytest.mark.slow
def test_a_wrong_number_of_such_a_law_is_found_and_accuses_no_joint(tmp_path):
    own_law(kd=2.0, carried=0.0).write(tmp_path)
    diagnosis = gap.diagnose(gap.read(tmp_path, run_law=True))
    assert diagnosis.verdict == "none" and diagnosis.controller.misdescribed
    assert {one.name for one in diagnosis.controller.parameters} == {"kd", "carried"}
