"""Names that logs give to the signals: the one table of column names, by where they come from.

In a pattern ``{joint}`` is any name and ``{k}`` a joint number; ``#`` stands for the number as
``[{k}]``, ``_{k}`` or ``{k}``.  ``{topic}`` is a path that ends in ``/`` or ``.`` (before ``?`` it
may be left out); ``{goal}`` is such a path with a word as ``command`` or ``reference`` in it, so
that a position under it is what the controller was asked for.
"""

from typing import NamedTuple

TIME_UNITS = ("ms", "us", "ns")
GOAL_WORDS = ("desired", "target", "command", "cmd", "goal", "reference", "setpoint", "set_point")
NUMBERINGS = ("[{k}]", "_{k}", "{k}")


WITHOUT_GRAVITY = ("u is the torque that was asked for beyond gravity, which the robot adds by "
                   "itself: leave gravity out of [nominal].")
CONTROL_INPUT = ("u is the torque of a motor only: of a MuJoCo actuator of the kind 'position', "
                 "ctrl is the reference qd.")


class Names(NamedTuple):
    """Names of one signal; signal None is what only looks like one, and is left alone.

    `unit`, and `side` of a torque (motor or joint), are given where the source defines them.
    `second` names are taken only where no first name is this signal.
    """

    signal: str | None
    written: str
    unit: str = ""
    side: str = ""
    second: bool = False
    remark: str = ""

    def patterns(self) -> list[str]:
        """Names with the shorthands written out."""
        whole = [pattern for name in self.written.split() for pattern in (
            (name.replace("?", ""), name.partition("?")[2]) if "?" in name else (name,))]
        return [pattern.replace("#", number) for pattern in whole
                for number in (NUMBERINGS if "#" in pattern else ("",))]


class Source(NamedTuple):
    """Where names come from, and where they are documented.

    With a `mark`, the names hold only in a log with a column that has it in its name, and are
    then tried first.
    """

    title: str
    reference: str
    names: tuple[Names, ...]
    mark: str = ""


SOURCES = (
    Source(
        "Universal Robots, RTDE and real-time client",
        "https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/"
        "rtde-guide.html", (
            Names("time", "timestamp"),
            Names("q", "actual_q# q_actual#", "rad"),
            Names("qd", "target_q# q_target#", "rad"),
            Names("dq", "actual_qd# qd_actual#", "rad/s"),
            Names("u", "joint_control_output# i_control#", "A", "motor"),
            Names("tau", "actual_current_as_torque#", "N m", "joint"),
            Names("tau", "actual_current# i_actual#", "A", "motor", second=True),
            Names(None, "target_qd# qd_target# target_qdd# qdd_target# target_current# i_target# "
                        "target_moment# m_target# actual_tcp_{joint} target_tcp_{joint} "
                        "joint_temperatures#"))),
    Source(
        "Franka, libfranka RobotState and franka_ros",
        "https://frankarobotics.github.io/libfranka/structfranka_1_1RobotState.html", (
            Names("q", "{topic}?q#", "rad"),
            Names("qd", "{topic}?q_d# {topic}?q_d", "rad"),
            Names("dq", "{topic}?dq#", "rad/s"),
            Names("tau", "{topic}?tau_J# {topic}?tau_J", "N m", "joint"),
            Names("u", "cmd.tau_J_d#", "N m", "joint", remark=WITHOUT_GRAVITY),
            Names("u", "{topic}?tau_J_d# {topic}?tau_J_d", "N m", "joint", second=True,
                  remark=WITHOUT_GRAVITY),
            Names(None, "{topic}?theta# {topic}?dtheta# {topic}?dtau_J# {topic}?dq_d# "
                        "{topic}?ddq_d# {topic}?tau_ext_hat_filtered# cmd.q_d# cmd.dq_d#")),
        mark="tau_J"),
    Source(
        "voraus-AD", "https://github.com/vorausrobotik/voraus-ad-dataset", (
            Names("q", "joint_position#", "rad"),
            Names("qd", "target_position#", "rad"),
            Names("dq", "joint_velocity#", "rad/s"),
            Names("tau", "motor_torque#", "N m", "motor"),
            Names("tau", "motor_iq#", "A", "motor", second=True),
            Names(None, "motor_position# motor_velocity# target_velocity# target_torque# "
                        "computed_torque# computed_inertia# torque_sensor_{joint} motor_id#")),
        mark="motor_iq"),
    Source(
        "FactoryNet", "https://arxiv.org/abs/2605.09081", (
            Names("q", "feedback_pos#", "rad"),
            Names("qd", "setpoint_pos#", "rad"),
            Names("dq", "feedback_vel#", "rad/s"),
            Names("tau", "effort_motor_torque# effort_torque#", "N m"),
            Names("tau", "effort_current#", "A", "motor", second=True),
            Names(None, "setpoint_vel# setpoint_acc# effort_target_torque# effort_force_{joint} "
                        "feedback_tcp#"))),
    Source(
        "ROS (JointState, controller_state, ros2_control, MoveIt), as PlotJuggler, rostopic and "
        "others export it",
        "https://docs.ros.org/en/rolling/p/sensor_msgs/msg/JointState.html", (
            Names("time", "__time"),
            Names("time", "{topic}?header/stamp {topic}?header.stamp {topic}?time_from_start",
                  second=True),
            Names("q", "{topic}position# {topic}position/{joint} {topic}position.{joint} "
                       "{topic}{joint}/position {topic}position {topic}positions# "
                       "{topic}positions/{joint} {topic}process_value", "rad"),
            Names("qd", "{goal}position# {goal}position/{joint} {goal}position.{joint} "
                        "{goal}{joint}/position {goal}position {goal}positions# "
                        "{goal}positions/{joint} {topic}set_point "
                        "{topic}position_controller/commands/data# "
                        "{topic}position_controllers/commands/data# "
                        "{topic}forward_position_controller/commands/data# "
                        "{topic}joint_group_position_controller/command/data#", "rad"),
            Names("dq", "{topic}velocity# {topic}velocity/{joint} {topic}velocity.{joint} "
                        "{topic}{joint}/velocity {topic}velocity {topic}velocities# "
                        "{topic}velocities/{joint}", "rad/s"),
            Names("tau", "{topic}effort# {topic}effort/{joint} {topic}effort.{joint} "
                         "{topic}{joint}/effort {topic}effort", "N m", "joint"),
            Names("u", "{goal}effort# {goal}effort/{joint} {goal}effort.{joint} "
                       "{goal}{joint}/effort {goal}effort {topic}output/effort# "
                       "{topic}output.effort# {topic}output/effort/{joint} "
                       "{topic}effort_controller/commands/data# "
                       "{topic}effort_controllers/commands/data# "
                       "{topic}forward_effort_controller/commands/data# "
                       "{topic}joint_group_effort_controller/command/data#", "N m", "joint"),
            Names(None, "{goal}velocity# {goal}velocity/{joint} {goal}{joint}/velocity "
                        "{goal}velocity {goal}velocities# {goal}velocities/{joint} "
                        "{topic}?error/positions# {topic}?error/velocities# "
                        "{topic}?error/effort# {topic}?error/positions/{joint} "
                        "{topic}?error/velocities/{joint} "
                        "{topic}?error.positions# {topic}?error.velocities# "
                        "{topic}?output/positions# {topic}?output/velocities# "
                        "{topic}output/positions/{joint} {topic}output/velocities/{joint} "
                        "{topic}?points[0]/positions# {topic}?points[0]/velocities# "
                        "{topic}?points[0].positions# {topic}?points[0].velocities# "
                        "{topic}pose/position/{joint} {topic}pose.position.{joint} "
                        "{topic}measured_joint_motor_state/position# "
                        "{topic}measured_joint_motor_state/velocity# "
                        "{topic}tau_ext_hat_filtered/effort#"))),
    Source(
        "LeRobot", "https://huggingface.co/docs/lerobot/lerobot-dataset-v3", (
            Names("time", "timestamp"),
            Names("q", "observation.state# observation.state.{joint}.pos "
                       "observation.state.{joint}"),
            Names("qd", "action# action.{joint}.pos action.{joint}"),
            Names(None, "frame_index episode_index task_index index"))),
    Source(
        "Isaac Lab", "https://isaac-sim.github.io/IsaacLab/main/source/api/lab/"
                     "isaaclab.assets.html", (
            Names("q", "{topic}?joint_pos# joint_pos_{joint}", "rad"),
            Names("qd", "{topic}?joint_pos_target# joint_pos_target_{joint}", "rad"),
            Names("dq", "{topic}?joint_vel# joint_vel_{joint}", "rad/s"),
            Names("u", "{topic}?computed_torque# computed_torque_{joint}", "N m", "joint"),
            Names("tau", "{topic}?applied_torque# applied_torque_{joint}", "N m", "joint"),
            Names("pe", "{topic}?joint_effort_target# joint_effort_target_{joint}", "N m",
                  "joint"),
            Names(None, "{topic}?joint_vel_target# joint_vel_target_{joint} {topic}?joint_acc# "
                        "joint_acc_{joint}"))),
    Source(
        "MuJoCo, mjData", "https://mujoco.readthedocs.io/en/stable/APIreference/APItypes.html", (
            Names("q", "{topic}?qpos# qpos_{joint} qpos {joint}_qpos", "rad"),
            Names("dq", "{topic}?qvel# qvel_{joint} qvel {joint}_qvel", "rad/s"),
            Names("u", "{topic}?ctrl# ctrl_{joint} ctrl {joint}_ctrl", remark=CONTROL_INPUT),
            Names("tau", "{topic}?actuator_force# actuator_force_{joint} actuator_force", "N m",
                  "motor"),
            Names("tau", "{topic}?qfrc_actuator# qfrc_actuator_{joint}", "N m", "joint",
                  second=True),
            Names(None, "{topic}?qacc# qacc_{joint} {topic}?qfrc_bias# qfrc_bias_{joint}"))),
    Source(
        "moteus", "https://github.com/mjbots/moteus/blob/main/docs/reference.md", (
            Names("q", "POSITION", "rev"),
            Names("qd", "CONTROL_POSITION", "rev"),
            Names("dq", "VELOCITY", "rev/s"),
            Names("u", "CONTROL_TORQUE", "N m", "joint"),
            Names("tau", "TORQUE", "N m", "joint"),
            Names(None, "COMMAND_POSITION COMMAND_VELOCITY CONTROL_VELOCITY Q_CURRENT D_CURRENT "
                        "MOTOR_TEMPERATURE")),
        mark="CONTROL_TORQUE"),
    Source(
        "Other names", "", (
            Names("time", "time t timestamp stamp time_s t_s time_sec seconds sec timestamp_s "
                          "pc_ts elapsed elapsed_time time_ms t_ms timestamp_ms time_us t_us "
                          "timestamp_us time_ns t_ns timestamp_ns"),
            Names("q", "q# q_{joint} q pos# pos_{joint} pos {joint}_pos {joint}.pos position# "
                       "position_{joint} position {joint}_position positions# "
                       "joint_position_{joint} joint_positions# actual_pos_{joint} "
                       "{joint}_actual_position measured_position_{joint} "
                       "{joint}_measured_position pos_meas# q_meas_{joint} measured_q_{joint} "
                       "qm"),
            Names("q", "theta# theta_{joint}", second=True),
            Names("q_motor", "q_motor# q_motor_{joint} q_motor"),
            Names("qd", "qd# qd_{joint} qd q_d# q_d_{joint} q_d q_des# q_des_{joint} q_ref# "
                        "q_ref_{joint} q_ref qref# pos_des# pos_des_{joint} pos_cmd_{joint} "
                        "cmd_pos_{joint} {joint}_pos_cmd {joint}_cmd_pos {joint}_target_pos "
                        "{joint}_pos_target {joint}_command {joint}_position_command "
                        "{joint}_position_reference {joint}_position_target "
                        "{joint}_position_desired {joint}_position_setpoint "
                        "{joint}_desired_position {joint}_target_position "
                        "{joint}_commanded_position {joint}_goal_position {joint}_reference "
                        "{joint}_ref {joint}_setpoint {joint}_goal {joint}_target "
                        "target_pos_{joint} pos_target_{joint} cmd_{joint} "
                        "joint_position_command_{joint} position_cmd_{joint} "
                        "position_command_{joint} position_reference_{joint} "
                        "command_position_{joint} desired_position_{joint} "
                        "target_position_{joint} goal_position_{joint} goal_position qg "
                        "reference_{joint} ref# ref_{joint} setpoint_{joint}"),
            Names("dq", "dq# dq_{joint} dq qdot# qdot_{joint} vel# vel_{joint} vel {joint}_vel "
                        "{joint}.vel velocity# velocity_{joint} velocity {joint}_velocity "
                        "velocities# joint_velocity_{joint} joint_velocities# "
                        "actual_vel_{joint} vel_meas# speed speed_{joint}"),
            Names("u", "u# u_{joint} u tau_cmd# tau_cmd_{joint} tau_con# cmd_tau_{joint} "
                       "torque_cmd_{joint} torque_command_{joint} cmd_torque_{joint} "
                       "command_torque_{joint} {joint}_torque_cmd {joint}_torque_command "
                       "{joint}_effort_cmd {joint}_effort_command effort_cmd_{joint} "
                       "effort_command_{joint} command_{joint}"),
            Names("u", "duty duty_{joint}", "duty", "motor"),
            Names("u", "vir", "V", "motor"),
            Names("pe", "pe# pe_{joint} pe excitation# excitation_{joint}"),
            Names("tau", "tau# tau_{joint} tau torque# torque_{joint} torque torques# "
                         "{joint}_torque effort# effort_{joint} effort efforts# "
                         "{joint}_effort joint_torque_{joint} joint_effort_{joint} "
                         "joint_efforts# tau_meas# tau_meas_{joint} measured_torque_{joint} "
                         "{joint}_measured_torque {joint}_tau"),
            Names(None, "tau_ext_{joint} qdd# qdd_{joint} ddq# ddq_{joint} dqd# dqd_{joint} "
                        "dq_d_{joint} dq_des_{joint} vel_des# tau_des# tau_abs_{joint} "
                        "{joint}_vel_cmd {joint}_velocity_command {joint}_velocity_reference "
                        "{joint}_acc {joint}_acceleration tool_{joint} tcp_{joint} "
                        "q_std_{joint}"))),
)
