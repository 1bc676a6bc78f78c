"""One corrected joint, run by the package's own sampled robot and by MuJoCo as exported."""

import dataclasses
import json
import re
import types
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from clie_blocks.analysis.export.correction import Correction, Joint
from clie_blocks.analysis.export.mujoco_stub import stub
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.compiled import compile_diagram
from clie_blocks.effects import LIBRARY
from clie_blocks.robot_loop import robot_loop

PERIOD = 1e-3  # s
INERTIA, DAMPING, LOAD = 0.02, 0.05, 0.01  # kg m^2, N m s/rad, N m
KP, KD = 8.0, 0.4  # N m/rad, N m s/rad
MOTOR = {"motor_inertia": 0.008, "motor_damping": 0.01}
VALUES = {  # of a joint of this size, where the typical one is of another
    "coulomb": {"level": 0.1}, "asymmetric_coulomb": {"forward": 0.1, "backward": 0.05},
    "stribeck": {"level": 0.08, "excess": 0.04, "velocity": 0.05, "exponent": 2.0},
    "soft_stop": {"lower": -0.3, "upper": 0.3}, "motor_heating": {"heating": 5e4},
    "rest_time_breakaway": {"half_time": 0.05, "slip": 0.1},
    "step_fault": {"time": 0.4}, "encoder_quantization": {"resolution": 4e-4},
    "spring": {"stiffness": 1.0, "hardening": 2.0, "rest": 0.1},
    "quadratic_drag": {"drag": 0.02, "cubic": 0.01}, "actuator_saturation": {"limit": 0.8},
    "torque_slew": {"rate": 15.0, "follow": 2e-4},
    "joint_elasticity": {"compliance": 1e-3, "damping": 0.5, **MOTOR},
    "stiffening_elasticity": {"compliance": 2e-3, "stiffening": 1.0, "knee": 0.3,
                              "damping": 0.5, **MOTOR},
    "torsional_hysteresis": {"level": 0.1, "reach": 0.1, "stiffness": 50.0, "damping": 0.1,
                             **MOTOR},
    "backlash": {"half_gap": 0.01, "stiffness": 300.0, "damping": 2.0, **MOTOR}}


def set_points(seconds, period=PERIOD):
    """Two sines that set in smoothly [rad], shape (N,)."""
    t = np.arange(round(seconds / period)) * period
    return np.minimum(t / 0.3, 1.0) * (0.4 * np.sin(2 * np.pi * t)
                                       + 0.1 * np.sin(2 * np.pi * 3.3 * t))


def setting(name, **values):
    """An effect at values that fit the joint."""
    return LIBRARY[name].typical(**{**VALUES.get(name, {}), **values})


def joint(**changes):
    """The joint, as an answer states it."""
    fields = {
        "name": "j1", "kind": "hinge", "unit_q": "rad", "unit_u": "N m", "zero": 0.0,
        "gear_ratio": 1.0, "encoder": "link", "gear": 1.0, "gain": 1.0, "torque": 1.0,
        "command": 1.0, "inertia": INERTIA, "beside_links": INERTIA, "links_known": False,
        "damping": DAMPING, "offset": -LOAD, "before": {"gear": 1.0, "gain": 1.0}}
    return Joint(**{**fields, **changes})


def correction(*effects, **changes):
    """The correction of that joint with some effects."""
    return Correction((joint(**changes),), PERIOD, effects)


def of_links(*effects, **changes):
    """The same, with the weight of the links as the load of the gear."""
    return dataclasses.replace(correction(*effects, **changes),
                               of_links=("load_dependent_friction",))


def reference(effects, q_d, inertia=INERTIA, damping=DAMPING, load=LOAD, period=PERIOD,
              links=None):
    """Positions of the package's sampled robot, of the shape of its set-points."""
    n = q_d[0].size
    robot = robot_loop(period=period, inertia=np.broadcast_to(inertia, n), damping=[damping] * n,
                       load=[load] * n, kp=[KP] * n, kd=[KD] * n, start=[0.0] * n,
                       saturation=[1e9] * n, gear_ratio=[1.0] * n, effects=list(effects),
                       links=links)
    run = compile_diagram(robot).run(len(q_d) * period, inputs={
        "q_d": q_d.reshape(-1, n), "pe": [0.0] * n, "noise": [0.0] * n})
    return np.asarray(run.outputs).T[:len(q_d), :n].reshape(q_d.shape)


def in_mujoco(exported, q_d, period=PERIOD):
    """Positions of an exported model under the same law, used as its files say.

    Of the shape of the set-points.
    """
    import mujoco

    (text,) = [text for name, text in exported.files.items() if name.endswith(".corrected.xml")]
    model = mujoco.MjModel.from_xml_string(text)
    data, joints = mujoco.MjData(model), None
    links = [row["joint"] for row in json.loads(exported.files["corrected_joints.json"])["joints"]]
    if "corrected_joints.py" in exported.files:
        module = types.ModuleType("corrected_joints")
        exec(exported.files["corrected_joints.py"], vars(module))
        joints = module.CorrectedJoints(model)
    q = np.zeros((len(q_d), len(links)))
    for i, wanted in enumerate(q_d):
        q[i] = ([data.joint(name).qpos[0] for name in links] if joints is None
                else joints.measured(data))
        u = KP * (wanted - q[i]) - KD * (q[i] - q[max(i - 1, 0)]) / period
        for _ in range(round(period / model.opt.timestep)):
            if joints is None:
                data.ctrl[:] = u
                mujoco.mj_step(model, data)
            else:
                joints.step(model, data, u)
    return q.reshape(q_d.shape)


def difference(*effects, seconds=1.0, period=PERIOD, step=None, integrator="RK4"):
    """RMS of effects in MuJoCo less the package's own robot, and what the effects do [rad].

    In a stub, or in one with another step [s] and integrator.
    """
    q_d, corrected = set_points(seconds, period), correction(*effects)
    expected = reference(effects, q_d, period=period)
    exported = export_mujoco(corrected)
    if step:
        with TemporaryDirectory() as folder:
            own = Path(folder) / "own.xml"
            own.write_text(re.sub(r'timestep="[^"]*" integrator="RK4"',
                                  f'timestep="{step}" integrator="{integrator}"',
                                  stub(corrected)))
            exported = export_mujoco(corrected, own)
    return (rms(in_mujoco(exported, q_d, period) - expected),
            rms(expected - reference((), q_d, period=period)))


def rms(values):
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))
