"""The run of a simulator in MuJoCo, as its file says or with a fault."""

import dataclasses
from collections import deque
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.simulator_faults.joint import GRAVITY, PERIOD, Joint
from clie_blocks.errors import MissingExtraError

STEP = 5e-4  # s, of the engine
HOLDS = 'solreffriction="0.004 1" solimpfriction="0.9999 0.9999 0.001"'

MODEL = """<mujoco model="joint">
  <compiler angle="radian" inertiafromgeom="{from_geom}"/>
  <option timestep="{step!r}" gravity="0 0 {gravity!r}" integrator="implicitfast"/>
  <worldbody>
    <body name="link" gravcomp="{gravcomp}">
      <inertial pos="{com!r} 0 0" mass="{mass!r}" diaginertia="1e-6 {inertia!r} {inertia!r}"/>
      <joint name="hinge" axis="0 -1 0" armature="{armature!r}" damping="{damping!r}"
             frictionloss="{friction!r}" {holds}/>
      <geom type="capsule" fromto="0 0 0 {length!r} 0 0" size="0.03" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="drive" joint="hinge" gear="{gear!r}" ctrllimited="true"
           ctrlrange="-{limit!r} {limit!r}"{delay}/>
  </actuator>
</mujoco>
"""


@dataclasses.dataclass(frozen=True)
class Run:
    """How a simulator runs; the defaults are what the file says.

    Parameters
    ----------
    changed : dict
        Numbers of the joint that the engine has otherwise.
    gravity, gravcomp : float
        Factor on gravity, and share of the weight that is taken away.
    soft : bool
        Dry friction with the engine's own softness.
    from_geom : bool
        The mass is that of the geoms.
    gains : float
        Factor on both gains.
    ticks : int
        Periods from one command to the next.
    step : float
        Of the engine [s].
    sensor_delay : int
        Periods by which the law sees positions late.
    joint_limit : bool
        The motor's limit acts on the torque behind the gear.

    """

    changed: dict[str, Any] = dataclasses.field(default_factory=dict)
    gravity: float = 1.0
    gravcomp: float = 0.0
    soft: bool = False
    from_geom: bool = False
    gains: float = 1.0
    ticks: int = 1
    step: float = STEP
    sensor_delay: int = 0
    joint_limit: bool = False


def model_text(joint: Joint, run: Run = Run()) -> str:
    """MJCF of a joint, or what a run makes of it."""
    numbers = dataclasses.replace(joint, **run.changed)
    delay = numbers.delay * PERIOD
    return MODEL.format(
        **{key: float(value) for key, value in dataclasses.asdict(numbers).items()
           if key not in ("kp", "kd", "delay")},
        length=2.0 * joint.com, gravity=-GRAVITY * run.gravity, gravcomp=run.gravcomp,
        step=run.step, from_geom="true" if run.from_geom else "auto",
        holds="" if run.soft else HOLDS,
        delay=f' delay="{delay!r}" nsample="{round(delay / run.step) + 2}"' if delay else "")


def simulate(joint: Joint, run: Run, q_d: np.ndarray, pe: np.ndarray) -> np.ndarray:
    """Log of a run: time, q, u, qd, pe, one row per period."""
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("a simulator with a fault", "mujoco", "mujoco") from None
    model = mujoco.MjModel.from_xml_string(model_text(joint, run))
    if run.joint_limit:
        model.actuator_forcelimited[:] = 0
        model.jnt_actfrclimited[:] = 1
        model.jnt_actfrcrange[:] = (-joint.limit, joint.limit)
    data = mujoco.MjData(model)
    data.qpos[0] = q_d[0]
    seen = deque([q_d[0]] * (run.sensor_delay + 1), run.sensor_delay + 1)
    substeps, last, u, rows = round(PERIOD / run.step), q_d[0], 0.0, []
    for k in range(len(q_d)):
        q = float(data.qpos[0])
        seen.append(q)
        rate, last = (seen[0] - last) / PERIOD, seen[0]
        if k % run.ticks == 0:
            u = run.gains * (joint.kp * (q_d[k] - seen[0]) - joint.kd * rate) + pe[k]
        rows.append((PERIOD * k, q, u, q_d[k], pe[k]))
        data.ctrl[0] = u
        mujoco.mj_step(model, data, substeps)
    return np.array(rows)
