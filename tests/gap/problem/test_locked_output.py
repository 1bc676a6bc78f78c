"""Lost motion, stiffness and breakaway of a gear whose output is locked."""

import dataclasses
import json

import numpy as np
import pytest

from clie_blocks.analysis.gap.command import main
from clie_blocks.analysis.gap.problem.locked_output import LockedError, is_locked, twists
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Experiment, Nominal
from clie_blocks.errors import NotIdentifiableError

GAP, STIFFNESS, FRICTION = np.radians(1.2), 800.0, 1.5
ROBOT = Robot(n=1, controller=Controller(law="unknown"), nominal=Nominal(output_locked=True))


def ramps(largest=20.0, count=3, source="ramps.csv"):
    """Torque ramps through zero, and the motor behind a spring with a gap and dry friction."""
    corners = np.array([0.0, *[1.0, -1.0] * count, 0.0])
    torque = largest * np.interp(np.arange(0.0, len(corners) - 1, 1e-3),
                                 np.arange(len(corners)), corners)
    q, place = np.zeros_like(torque), 0.0
    for i, each in enumerate(torque):
        low, high = (twist / STIFFNESS + np.sign(twist) * GAP / 2
                     for twist in (each - FRICTION, each + FRICTION))
        place = min(max(place, low), high)  # friction holds the motor between the two
        q[i] = place
    q += 2e-5 * np.random.default_rng(0).normal(size=q.size)
    return Record(time=0.004 * np.arange(q.size), q=q[:, None], u=torque[:, None], robot=ROBOT,
                  source=source)


def test_lost_motion_stiffness_and_breakaway_of_ramps():
    (found,) = twists(ramps())
    low, median, high = found.lost_motion
    assert median == pytest.approx(GAP, rel=0.1) and high - low < 0.1 * GAP
    growing, falling = found.stiffness
    assert growing == pytest.approx(STIFFNESS, rel=0.05)
    assert falling > growing  # friction holds the motor first
    assert found.breakaway == pytest.approx(FRICTION, abs=1.0)
    assert found.sweeps == 5


def test_a_torque_of_one_direction_shows_no_lost_motion():
    record = ramps()
    with pytest.raises(NotIdentifiableError, match="ramp it up and down through zero"):
        twists(record.replace(u=np.abs(record.u)))
    with pytest.raises(NotIdentifiableError, match="no torque is logged"):
        twists(record.replace(u=None))


def test_one_log_or_all_may_be_locked():
    record = ramps(source="/somewhere/ramps.csv.gz")
    one = dataclasses.replace(ROBOT, nominal=Nominal(), experiments={
        "ramps": Experiment(output_locked=True)})
    assert is_locked(record, ROBOT) and is_locked(record, one)
    assert not is_locked(record.replace(source="other.csv"), one)


def test_a_locked_log_is_left_out_of_the_motion():
    robot = dataclasses.replace(ROBOT, nominal=Nominal(), experiments={
        "ramps": Experiment(output_locked=True)})
    time = 0.004 * np.arange(2000)
    free = Record(time=time, q=np.sin(3 * time)[:, None], u=-np.sin(3 * time)[:, None],
                  robot=robot, source="free.csv")
    problem = Problem.from_logs(robot, [ramps(), free])
    assert [log.name for log in problem.logs] == ["free.csv"] and len(problem.twists) == 1
    with pytest.raises(LockedError, match="add a log with a free output"):
        Problem.from_logs(robot, [ramps()])


def test_the_command_answers_with_the_twist_where_all_is_locked(tmp_path, capsys):
    record, folder = ramps(), tmp_path / "gear"
    folder.mkdir()
    np.savetxt(folder / "ramps.csv", np.column_stack([record.time, record.q, record.u]),
               delimiter=",", header="time,q1,u1", comments="")
    (folder / "robot.toml").write_text("joints = 1\n[nominal]\noutput_locked = true\n")
    assert main([str(folder), "-o", str(tmp_path / "out")]) == 0
    assert "gear: Output locked, joint1: lost motion 1." in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "gear.json").read_text())["verdict"] == "locked"
    assert main([str(folder), "-o", str(tmp_path / "out")]) == 0  # read back
    assert "lost motion" in capsys.readouterr().out


def test_the_ramps_of_the_cycloidal_joint(shared):
    from clie_blocks.analysis.records.read import read_logs

    (record,) = read_logs([shared / "data" / "cycloidal" /
                           "ramps_output_locked_base_onyx.csv.gz"], ROBOT)
    (found,) = twists(record)
    print(found)
    assert 1.0 < np.degrees(found.lost_motion[1]) < 1.5
    assert 300.0 < found.stiffness[0] < found.stiffness[1] < 1650.0
    assert 2.5 < found.breakaway < 3.5
