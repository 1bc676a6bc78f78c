"""Columns as robots, middleware and simulators name them: signal, unit, side, questions."""

import shlex

import numpy as np
import pytest

from clie_blocks.analysis.records import check_report, read_record
from clie_blocks.analysis.records.aliases import SOURCES
from clie_blocks.analysis.records.columns import find_columns
from clie_blocks.errors import RecordError

HEADERS = {
    "PlotJuggler, joint last": (
        "__time,/joint_states/position/pan,/joint_states/position/elbow,/joint_states/effort/pan,"
        "/joint_states/effort/elbow,/joint_states/header/stamp",
        {"time": "__time", "q": "/joint_states/position/pan", "tau": "/joint_states/effort/pan"},
        ("pan", "elbow")),
    "PlotJuggler, joint first": (
        "__time,/joint_states/pan/position,/joint_states/pan/velocity,/joint_states/pan/effort",
        {"q": "/joint_states/pan/position", "dq": "/joint_states/pan/velocity",
         "tau": "/joint_states/pan/effort"}, ("pan",)),
    "ROS, numbered, with a command topic": (
        "__time,/joint_states/position[0],/joint_states/effort[0],/joint_command/position[0],"
        "/joint_command/velocity[0],/joint_command/effort[0]",
        {"q": "/joint_states/position[0]", "tau": "/joint_states/effort[0]",
         "qd": "/joint_command/position[0]", "u": "/joint_command/effort[0]"}, ("joint1",)),
    "ROS 2, controller_state": (
        "__time,/jtc/controller_state/reference/positions[0],"
        "/jtc/controller_state/reference/velocities[0],/jtc/controller_state/feedback/positions[0],"
        "/jtc/controller_state/feedback/velocities[0],/jtc/controller_state/error/positions[0],"
        "/jtc/controller_state/output/effort[0]",
        {"q": "/jtc/controller_state/feedback/positions[0]",
         "qd": "/jtc/controller_state/reference/positions[0]",
         "dq": "/jtc/controller_state/feedback/velocities[0]",
         "u": "/jtc/controller_state/output/effort[0]"}, ("joint1",)),
    "MoveIt, feedback of a trajectory": (
        "time,desired.positions[0],desired.velocities[0],actual.positions[0],error.positions[0]",
        {"q": "actual.positions[0]", "qd": "desired.positions[0]"}, ("joint1",)),
    "rostopic echo -p": (
        "time,field.header.seq,field.header.stamp,field.position0,field.velocity0,field.effort0",
        {"time": "time", "q": "field.position0", "dq": "field.velocity0",
         "tau": "field.effort0"}, ("joint1",)),
    "ros2_control": (
        "time,state_interface.pan/position,state_interface.pan/effort,"
        "command_interface.pan/position,command_interface.pan/effort",
        {"q": "state_interface.pan/position", "tau": "state_interface.pan/effort",
         "qd": "command_interface.pan/position", "u": "command_interface.pan/effort"}, ("pan",)),
    "ros2_control, one joint": (
        "time,state_interface.position,state_interface.velocity,command_interface.effort",
        {"q": "state_interface.position", "dq": "state_interface.velocity",
         "u": "command_interface.effort"}, ("joint1",)),
    "names with an ending": (
        "time,pan_position,pan_effort,pan_position_command,pan_effort_command",
        {"q": "pan_position", "tau": "pan_effort", "qd": "pan_position_command",
         "u": "pan_effort_command"}, ("pan",)),
    "names with _reference": (
        "time,hip_position,knee_position,hip_reference,knee_reference",
        {"q": "hip_position", "qd": "hip_reference"}, ("hip", "knee")),
    "UR, RTDE": (
        "timestamp,target_q_0,target_qd_0,target_moment_0,target_current_0,actual_q_0,actual_qd_0,"
        "actual_current_0,joint_control_output_0,actual_TCP_pose_0",
        {"q": "actual_q_0", "qd": "target_q_0", "dq": "actual_qd_0", "tau": "actual_current_0",
         "u": "joint_control_output_0"}, ("joint1",)),
    "UR, real-time client": (
        "timestamp,q_target_0,qd_target_0,m_target_0,q_actual_0,qd_actual_0,i_actual_0,i_control_0",
        {"q": "q_actual_0", "qd": "q_target_0", "dq": "qd_actual_0", "tau": "i_actual_0",
         "u": "i_control_0"}, ("joint1",)),
    "UR, torque in N m": (
        "timestamp,actual_q_0,target_q_0,actual_current_0,actual_current_as_torque_0",
        {"q": "actual_q_0", "qd": "target_q_0", "tau": "actual_current_as_torque_0"},
        ("joint1",)),
    "Franka, flat": (
        "time,q_0,q_d_0,dq_0,dq_d_0,tau_J_0,tau_J_d_0,dtau_J_0,theta_0,dtheta_0,"
        "tau_ext_hat_filtered_0",
        {"q": "q_0", "qd": "q_d_0", "dq": "dq_0", "tau": "tau_J_0", "u": "tau_J_d_0"},
        ("joint1",)),
    "Franka, franka_ros": (
        "time,franka_state.q[0],franka_state.q_d[0],franka_state.theta[0],franka_state.tau_J[0],"
        "franka_state.tau_J_d[0]",
        {"q": "franka_state.q[0]", "qd": "franka_state.q_d[0]", "tau": "franka_state.tau_J[0]",
         "u": "franka_state.tau_J_d[0]"}, ("joint1",)),
    "Franka, franka_ros2": (
        "__time,/f/measured_joint_state/position[0],/f/desired_joint_state/position[0],"
        "/f/measured_joint_motor_state/position[0],/f/tau_ext_hat_filtered/effort[0]",
        {"q": "/f/measured_joint_state/position[0]", "qd": "/f/desired_joint_state/position[0]"},
        ("joint1",)),
    "LeRobot, lists": (
        "timestamp,frame_index,episode_index,index,task_index,observation.state[0],action[0]",
        {"time": "timestamp", "q": "observation.state[0]", "qd": "action[0]"}, ("joint1",)),
    "LeRobot, by name": (
        "timestamp,observation.state.pan.pos,action.pan.pos",
        {"q": "observation.state.pan.pos", "qd": "action.pan.pos"}, ("pan",)),
    "Isaac Lab": (
        "time,joint_pos[0],joint_vel[0],joint_pos_target[0],joint_vel_target[0],"
        "joint_effort_target[0],computed_torque[0],applied_torque[0]",
        {"q": "joint_pos[0]", "dq": "joint_vel[0]", "qd": "joint_pos_target[0]",
         "pe": "joint_effort_target[0]", "u": "computed_torque[0]", "tau": "applied_torque[0]"},
        ("joint1",)),
    "MuJoCo": (
        "time,qpos_0,qvel_0,qacc_0,ctrl_0,actuator_force_0,qfrc_actuator_0",
        {"q": "qpos_0", "dq": "qvel_0", "u": "ctrl_0", "tau": "actuator_force_0"}, ("joint1",)),
    "voraus-AD": (
        "time,sample,action,target_position_1,target_velocity_1,target_torque_1,"
        "computed_inertia_1,computed_torque_1,motor_position_1,joint_position_1,"
        "joint_velocity_1,motor_torque_1,torque_sensor_a_1,motor_iq_1,motor_id_1",
        {"q": "joint_position_1", "qd": "target_position_1", "dq": "joint_velocity_1",
         "tau": "motor_torque_1", "u": "motor_torque_1"}, ("joint1",)),
    "moteus": (
        "TIME,POSITION,CONTROL_POSITION,COMMAND_POSITION,VELOCITY,CONTROL_VELOCITY,TORQUE,"
        "CONTROL_TORQUE,Q_CURRENT",
        {"q": "POSITION", "qd": "CONTROL_POSITION", "dq": "VELOCITY", "tau": "TORQUE",
         "u": "CONTROL_TORQUE"}, ("joint1",)),
    "FactoryNet": (
        "time,setpoint_pos_0,setpoint_vel_0,feedback_pos_0,feedback_vel_0,effort_motor_torque_0,"
        "effort_current_0",
        {"q": "feedback_pos_0", "qd": "setpoint_pos_0", "dq": "feedback_vel_0",
         "tau": "effort_motor_torque_0"}, ("joint1",)),
}


@pytest.mark.parametrize("source", HEADERS)
def test_columns_of_a_source(source):
    header, wanted, joints = HEADERS[source]
    names = header.split(",")
    found = find_columns(names, "log.csv")
    taken = {signal: names[columns[0]] for signal, columns in found.columns.items()}
    assert taken == {signal: name for signal, name in wanted.items() if signal != "time"}
    assert names[found.time] == wanted.get("time", names[0])
    assert found.joints == joints
    assert {len(columns) for columns in found.columns.values()} == {len(joints)}


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.title[:12])
def test_every_name_of_the_table_is_found_where_it_is_the_only_one(source):
    """Each pattern, written as a column, is its signal; a command has a position beside it."""
    for names in source.names:
        for pattern in names.patterns():
            column = pattern.format(k=0, joint="elbow", topic="/robot/", goal="/robot/command/")
            others = {"time": "time", "q": "q_elbow" if "{joint}" in pattern else
                      "q0" if "{k}" in pattern else "q"}
            header = [f"x_{source.mark}_x", *(name for signal, name in others.items()
                                     if signal != names.signal), column]
            found = find_columns(header, "log.csv")
            taken = {header[index] for signal, columns in found.columns.items()
                     if signal == names.signal for index in columns}
            taken |= {header[found.time]} if names.signal == "time" else set()
            assert (column in taken) == (names.signal is not None), (pattern, found.columns)


def test_a_motor_current_stands_for_a_command_that_is_not_logged():
    found = find_columns("timestamp,actual_q_0,target_q_0,actual_current_0".split(","), "log.csv")
    assert found.columns["u"] == found.columns["tau"] == [3]
    assert any("the measured current of the motor stands for it" in note
               for note in found.decisions)
    both = "timestamp,actual_q_0,actual_current_0,joint_control_output_0"
    logged = find_columns(both.split(","), "log.csv")
    assert (logged.columns["u"], logged.columns["tau"]) == ([3], [2])
    torque = find_columns("time,joint_pos[0],applied_torque[0]".split(","), "log.csv")
    assert "u" not in torque.columns  # joint side: no statement of the motor


def write(path, header, rows=3):
    width = header.count(",")
    lines = [header, *(",".join(map(str, [0.01 * n, *[n + 1.0] * width])) for n in range(rows))]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_units_come_from_header_then_robot_file_then_source(tmp_path):
    header = "timestamp,actual_q_0,target_q_0,actual_current_0"
    record = read_record(write(tmp_path / "log.csv", header))
    assert record.units["tau"] == record.units["u"] == ("A",)
    assert "tau is in A, not a torque, as its name says." in record.decisions
    assert not any("No unit is stated" in note for note in record.decisions)
    (tmp_path / "robot.toml").write_text(
        'joints = 1\n[units]\nq = "deg"\ntau = "N m"\nu = "N m"\n')
    stated = read_record(tmp_path / "log.csv")
    assert stated.units["tau"] == ("N m",)
    np.testing.assert_allclose(stated.q, np.radians(record.q))
    assert not any("as its name says" in note for note in stated.decisions)
    log = write(tmp_path / "rad.csv", header.replace("actual_q_0", "actual_q_0[rad]"))
    np.testing.assert_array_equal(read_record(log).q, record.q)


@pytest.mark.parametrize("header, remark", [
    ("time,q_0,tau_J_0,tau_J_d_0", "tau is on the joint side"),
    ("time,q_0,tau_J_0,tau_J_d_0", "beyond gravity"),
    ("time,qpos_0,ctrl_0", "actuator of the kind 'position', ctrl is the reference")])
def test_what_the_source_defines_is_said(header, remark):
    assert any(remark in note for note in find_columns(header.split(","), "log.csv").decisions)


def test_all_rivals_are_named_with_options_that_settle_it(tmp_path):
    header = ("__time,/joint_states/position[0],/jtc/controller_state/feedback/positions[0],"
              "/a/reference/positions[0],/b/reference/positions[0]")
    log = write(tmp_path / "log.csv", header)
    with pytest.raises(RecordError, match="could both be q; .*could both be qd; ") as refused:
        read_record(log)
    options = dict(text.split(" or ")[0].split(" --map ")[-1] and
                   shlex.split(text.partition("choose one: ")[2].split(" or ")[0])[1].split("=", 1)
                   for text in str(refused.value).split("; columns"))
    assert options == {"q": "/joint_states/position[{k}]", "qd": "/a/reference/positions[{k}]"}
    record = read_record(log, columns=options)
    assert record.signals == ("q", "qd")


@pytest.mark.parametrize("header", ["time,weird_1,weird_2", "when,q1", "time,foo bar 1"])
def test_the_example_of_a_missing_signal_fits_a_column(tmp_path, header, capsys):
    log = write(tmp_path / "log.csv", header)
    with pytest.raises(RecordError, match="as in --map ") as refused:
        read_record(log)
    (option,) = shlex.split(str(refused.value).partition("as in --map ")[2])
    signal, pattern = option.split("=", 1)
    assert signal in read_record(log, columns={signal: pattern}).signals or signal == "time"
    check_report.main([str(log), "--map", option])
    assert "samples" in capsys.readouterr().out


def test_numbers_that_name_joints_can_be_mapped_as_the_note_says():
    names = "__time,/js/pan/position,/js/elbow/position,/r/reference/positions[0],"\
            "/r/reference/positions[1]".split(",")
    (note,) = [note for note in find_columns(names, "log").decisions if "Did not take" in note]
    option = shlex.split(note.rstrip(".").partition("--map ")[2])[0]
    found = find_columns(names, "log", dict([option.split("=", 1)]))
    assert found.columns == {"q": [1, 2], "qd": [3, 4]}
