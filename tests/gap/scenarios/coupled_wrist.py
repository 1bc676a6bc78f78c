"""A wrist in MuJoCo whose motors turn several joints, as its owner sees it.

Each motor is a fixed tendon over the joints, with its rotor, its drag and its dry friction, so
that the engine has the coupling from nowhere but `C`.
"""

import numpy as np

PERIOD, SUBSTEPS = 2e-3, 4
RATIO = np.array([80.0, 60.0, 50.0])
ROTOR = np.array([4e-5, 3e-5, 3e-5])
DRAG = np.array([4e-4, 3e-4, 3e-4])
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.8, 1.0]])  # motor 2 turns joint 3, too
NOISE, ENCODER_STEP, COMMAND_STEP = 2e-5, 2e-5, 1e-5
JOINTS = "roll", "bend", "flange"
LINKS = """
<body pos="0 0 0.1"><joint name="roll" axis="1 0 0"/>
  <inertial pos="0.15 0.01 0" mass="2.5" diaginertia="0.01 0.02 0.02"/>
  <body pos="0.3 0 0"><joint name="bend" axis="0 1 0"/>
    <inertial pos="0.08 0 0.01" mass="1.6" diaginertia="0.004 0.006 0.006"/>
    <body pos="0.12 0 0"><joint name="flange" axis="1 0 0"/>
      <inertial pos="0.05 0.03 0.01" mass="0.9" diaginertia="0.002 0.002 0.002"/>
    </body></body></body>"""


def model_text(friction=(0.0, 0.0, 0.0), coupling=C, links=LINKS):
    """Model with a fixed tendon for each motor."""
    shares = np.linalg.inv(coupling)
    tendons = "".join(
        f'<fixed armature="{r * r * j}" damping="{r * r * d}" frictionloss="{r * f}" '
        'solreffriction="0.004 1" solimpfriction="0.9999 0.9999 0.001">'
        + "".join(f'<joint joint="{name}" coef="{c}"/>' for name, c in zip(JOINTS, row) if c)
        + "</fixed>" for r, j, d, f, row in zip(RATIO, ROTOR, DRAG, friction, shares))
    return f"""<mujoco><compiler angle="radian"/>
<option timestep="{PERIOD / SUBSTEPS}" integrator="RK4"/>
<worldbody>{links}</worldbody><tendon>{tendons}</tendon></mujoco>"""


def references(seed, time, wave):
    """Set-points of the motors."""
    rng = np.random.default_rng(seed)
    columns = []
    for home in (0.4, -0.5, 0.3):
        f, size, phase = rng.uniform([0.1, 0.08, 0.0], [0.7, 0.3, 6.0], (4, 3)).T[:, :, None]
        w = 2 * np.pi * f
        sines = np.sum(size * (np.sin(w * time + phase) - np.sin(phase)), axis=0)
        columns.append(home + (sines if wave else 0.5 * np.interp(
            (time * rng.uniform(0.12, 0.25)) % 1.0, [0, 0.25, 0.75, 1], [0, 1, -1, 0])))
    return np.stack(columns, axis=1)


def gains():
    """Gains of the motors."""
    inertia = RATIO * ROTOR + np.array([0.05, 0.06, 0.008]) / RATIO
    return np.round(inertia * 22.0**2, 4), np.round(1.6 * inertia * 22.0, 5)


def write(folder, seconds=8.0, friction=(0.0, 0.0, 0.0), lines="", of_joints=True, coupling=C,
          links=LINKS, stated=LINKS):
    """Write two logs, the links that are stated, and the robot file; lines go into [motor]."""
    import mujoco

    folder.mkdir(parents=True, exist_ok=True)
    kp, kd = gains()
    inverse, rng = np.linalg.inv(coupling), np.random.default_rng(1)
    for number in (1, 2):
        model = mujoco.MjModel.from_xml_string(model_text(friction, coupling, links))
        data, time = mujoco.MjData(model), np.arange(0.0, seconds, PERIOD)
        goals = references(number, time, number == 1)
        data.qpos[:] = coupling @ goals[0]
        rows, before = [], None
        for t, goal in zip(time, goals):
            q = inverse @ data.qpos + NOISE * rng.standard_normal(3)
            q = ENCODER_STEP * np.round(q / ENCODER_STEP)
            before = q if before is None else before
            u = kp * (goal - q) - kd * (q - before) / PERIOD
            u, before = COMMAND_STEP * np.round(u / COMMAND_STEP), q
            rows.append([t, *((coupling @ q, coupling @ goal) if of_joints else (q, goal)), u])
            data.qfrc_applied[:] = inverse.T @ (RATIO * u)
            for _ in range(SUBSTEPS):
                mujoco.mj_step(model, data)
        table = np.array([np.concatenate([np.atleast_1d(part) for part in row]) for row in rows])
        head = "time," + ",".join(f"{name}{k}" for name in ("q", "qd", "u") for k in (1, 2, 3))
        np.savetxt(folder / f"log-{number}.csv", table, "%.10g", ",", header=head, comments="")
    (folder / "wrist.xml").write_text(
        f'<mujoco><compiler angle="radian"/><worldbody>{stated}</worldbody></mujoco>')
    (folder / "robot.toml").write_text(f"""name = "wrist"
joints = 3
joint_names = ["roll", "bend", "flange"]
[motor]
gear_ratio = {RATIO.tolist()}
inertia_kgm2 = {ROTOR.tolist()}
viscous_friction_nms = {DRAG.tolist()}
inertia_tolerance = 0.02
viscous_friction_tolerance = 0.2
torque_offset_tolerance_nm = 0.01
{lines}
[links]
model = "wrist.xml"
[controller]
Kp = {kp.tolist()}
Kd = {kd.tolist()}
velocity_filter = "difference"
sample_time_s = {PERIOD}
hold = "zero-order"
command_resolution_nm = {COMMAND_STEP}
[encoder]
mounting = "motor side"
{"" if of_joints else 'positions = "motors"'}
""")
    return folder
