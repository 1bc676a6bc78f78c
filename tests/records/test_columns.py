"""Which column is which signal: guessed only when there is one answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.records import read_record, read_robot
from clie_blocks.analysis.records.columns import find_columns
from clie_blocks.analysis.records.units import split_unit, to_si
from clie_blocks.errors import RecordError


def layout(header, **said):
    return find_columns(header.split(","), "log.csv", **said)


@pytest.mark.parametrize("header, columns, joints", [
    ("time,q1,q2,u1,u2,qd1,qd2,pe1,pe2",
     {"q": [1, 2], "u": [3, 4], "qd": [5, 6], "pe": [7, 8]}, ("joint1", "joint2")),
    ("time,q1,u1,qd1,pe1", {"q": [1], "u": [2], "qd": [3], "pe": [4]}, ("joint1",)),
    ("t,q_elbow,dq_elbow,tau_elbow", {"q": [1], "dq": [2], "tau": [3]}, ("elbow",)),
    # one column per joint and quantity, as simulators write them
    ("time,hip_pos,knee_pos,hip_vel,knee_vel,hip_effort,knee_effort,hip_pos_cmd,knee_pos_cmd",
     {"q": [1, 2], "dq": [3, 4], "tau": [5, 6], "qd": [7, 8]}, ("hip", "knee")),
    ("time,q_10,q_9,u_10,u_9", {"q": [2, 1], "u": [4, 3]}, ("joint1", "joint2")),
    ("TIME,Q1,U1", {"q": [1], "u": [2]}, ("joint1",)),
    ("time,q1,u1,supply [mV]", {"q": [1], "u": [2], "supply": [3]}, ("joint1",)),
])
def test_known_headers(header, columns, joints):
    found = layout(header)
    assert {signal: found.columns[signal] for signal in found.columns} == columns
    assert found.time == 0
    assert found.joints == joints


def test_our_own_names_are_no_guess_and_others_are():
    assert layout("time,q1,u1").decisions == ()
    assert "Read q (measured joint position) from pos1." in layout("time,pos1").decisions
    assert any("numbered from 0" in note for note in layout("time,q0,q1").decisions)


def test_the_supply_is_a_channel_of_the_whole_robot_in_volts(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time,q1,q2,vbus [mV]\n" + "\n".join(
        f"{0.01 * k:.2f},0.1,0.2,{7400 - k}" for k in range(50)) + "\n")
    assert not read_record(log).extra
    record = read_record(log, columns={"supply": "vbus"})
    np.testing.assert_allclose(record.extra["supply"], 7.4 - 1e-3 * np.arange(50), rtol=1e-12)
    assert record.signals == ("q",) and any("vbus" in note for note in record.decisions)


@pytest.mark.parametrize("header, said, message", [
    ("time,q1,pos1", {}, "'q1' and 'pos1' could both be q.*--map q="),
    ("time,timestamp,q1", {}, "could both be time"),
    ("time,foo,bar", {}, "no column is recognised as q.*the log has time, foo, bar"),
    ("q1,u1", {}, "no column is recognised as time"),
    ("time,q1,q1", {}, "two columns are called 'q1'"),
    ("time,a,b", {"user_map": {"p": "a"}}, "--map p=.*did you mean 'pe'.*known: pe, time, q"),
    ("t_a,q_a", {"user_map": {"time": "t_{joint}"}}, "must name one column"),
    ("time,q1", {"user_map": {"supply": "v_{joint}"}}, "must name one column"),
    ("time,q1,vbus", {"user_map": {"supply": "vbsu"}}, "no column is called.*did you mean 'vbus'"),
    ("time,a,b", {"user_map": {"q": "x_{joint}"}}, "no column fits --map q=x_{joint}"),
    ("time,q1,q2,u1", {"user_map": {"u": "u{k}"}}, "is missing for at least one joint"),
    ("time,q1,q2", {"user_map": {"u": "u{k}"}}, "is missing for at least one joint"),
    ("time,q_a,q_c", {"joints": ("a", "b")}, "joint 'c' of the log is not one of the robot"),
    ("time,q1,q2,q3", {"joints": ("joint1", "joint2")}, "has 3 joints.*robot has 2"),
])
def test_what_is_not_unambiguous_is_asked(header, said, message):
    with pytest.raises(RecordError, match=message):
        layout(header, **said)


def test_numbered_columns_of_the_map_follow_the_joints():
    header = "time,hip_pos,knee_pos,motor2_ctrl,motor1_ctrl"
    assert "u" not in layout(header).columns
    assert layout(header, user_map={"u": "motor{k}_ctrl"}).columns["u"] == [4, 3]


def test_letters_that_differ_only_in_case_are_told_apart():
    found = layout("T,t,Q1,q1,U1,u1")
    assert (found.time, found.columns) == (1, {"q": [3], "u": [5]})
    assert "Not used: T, Q1, U1." in found.decisions


def test_a_signal_that_is_not_there_for_all_joints_is_not_taken():
    found = layout("time,q1,q2,u1,temperature")
    assert "u" not in found.columns
    assert any("Did not take u from u1" in note for note in found.decisions)
    assert "Not used: u1, temperature." in found.decisions


def test_the_users_map_comes_first():
    found = layout("stamp2,ang_b,ang_a,q_a,q_b", user_map={"time": "stamp2", "q": "ang_{joint}"})
    assert found.columns == {"q": [1, 2]}
    assert found.joints == ("b", "a")
    assert layout("time,q_b,q_a", joints=("a", "b")).columns["q"] == [2, 1]


def test_columns_and_units_from_the_robot_file(tmp_path):
    (tmp_path / "log.csv").write_text("clock,ang_a,ang_b,i_a,i_b\n0,180,90,1,2\n10,90,45,1,2\n")
    (tmp_path / "robot.toml").write_text(
        'joints = 2\njoint_names = ["b", "a"]\n[units]\nq = "deg"\nu = "A"\ntime = "ms"\n'
        '[columns]\ntime = "clock"\nq = "ang_{joint}"\nu = "i_{joint}"\n')
    record = read_record(tmp_path / "log.csv", read_robot(tmp_path / "robot.toml"))
    np.testing.assert_allclose(record.time, [0, 0.01])
    np.testing.assert_allclose(record.q, np.pi * np.array([[0.5, 1], [0.25, 0.5]]))
    assert record.units["u"] == ("A", "A")
    assert record.joints == ("b", "a")
    mapped = read_record(tmp_path / "log.csv", time_unit="s",
                         columns={"q": "i_{joint}", "u": "ang_{joint}"})
    np.testing.assert_array_equal(mapped.u[:, 1], [180, 90])
    np.testing.assert_array_equal(mapped.time, [0, 10])


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.permutations(["time", "q1", "q2", "u1", "u2", "qd1", "qd2", "dq1", "dq2"]))
def test_the_order_of_columns_does_not_matter(header):
    found = find_columns(header, "log.csv")
    assert header[found.time] == "time"
    for signal in ("q", "u", "qd", "dq"):
        assert [header[index] for index in found.columns[signal]] == [f"{signal}1", f"{signal}2"]


@pytest.mark.parametrize("header, name, unit", [
    ("q_elbow[deg]", "q_elbow", "deg"), ("t (us)", "t", "us"), ("q[0]", "q[0]", None),
    ("q[0] [deg]", "q[0]", "deg"), ("q1", "q1", None)])
def test_units_in_headers(header, name, unit):
    assert split_unit(header) == (name, unit)


def test_factors_to_si():
    assert to_si("deg", "q", "")[0] == pytest.approx(np.pi / 180)
    assert to_si("rpm", "dq", "")[0] == pytest.approx(2 * np.pi / 60)
    assert to_si("Nm", "u", "") == (1.0, "N m")
    assert to_si("mm", "q", "") == (1e-3, "m")
    with pytest.raises(RecordError, match="here: unit 'degs' is not known; did you mean 'deg'"):
        to_si("degs", "q", "here")
    with pytest.raises(RecordError, match="q cannot be in 'Nm'"):
        to_si("Nm", "q", "here")


def test_one_column_is_the_joint_whatever_its_name():
    found = layout("stamp,pos,goal,cur", user_map={"time": "stamp", "q": "pos", "u": "cur"},
                   joints=("calf",))
    assert found.joints == ("calf",) and found.columns == {"q": [1], "u": [3]}
    with pytest.raises(RecordError, match="1 joints .a column without a number., the robot has 2"):
        layout("stamp,pos,cur", user_map={"time": "stamp", "q": "pos", "u": "cur"},
               joints=("hip", "calf"))
