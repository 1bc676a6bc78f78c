"""Robots to calibrate on as an engineer meets them: logs, and a file that says what is known."""

import numpy as np

from clie_blocks.analysis.gap.own_plant import PERIOD
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.robot import (
    Controller,
    Encoder,
    Experiment,
    Links,
    Motor,
    Nominal,
    Robot,
)


def record(j, log, q, u):
    """Record of one log of a robot to calibrate on.

    Parameters
    ----------
    j : int
        Place of the log.
    log : list of dict
        Lanes of its joints.
    q, u : ndarray, shape (N, n)
        Measured positions [rad] and commands [N m].

    """
    return Record(time=PERIOD * np.arange(len(q)), q=q, u=u, source=f"log-{j + 1}",
                  qd=np.stack([lane["q_d"] for lane in log], axis=1),
                  pe=np.stack([lane["pe"] for lane in log], axis=1))


def robot(joints):
    """What an engineer would know of a robot to calibrate on.

    Parameters
    ----------
    joints : list of dict
        Its drawn joints, as lanes.

    """
    n = len(joints)

    def column(key):
        return np.array([joint[key] for joint in joints])

    ratio, inertia, link = column("ratio"), column("nominal_inertia"), column("link")
    links = Links()
    if n == 1:  # a point mass on a rod that weighs and resists as the lane says
        length = 9.81 * link / column("weight")
        links = Links(length=length, com=length, mass=link * ratio / length**2, inertia=[0.0],
                      joint_viscous_friction=[0.0])
    else:
        link = 0.0 * link
    return Robot(
        n=n, name="simulated", links=links, nominal=Nominal(gravity=n == 1, coupling=False),
        motor=Motor(gear_ratio=ratio, inertia=(inertia - link) / ratio,
                    viscous_friction=inertia * column("rate") / ratio, inertia_tolerance=0.01,
                    viscous_friction_tolerance=0.15,
                    torque_offset_tolerance=0.01 * column("kp")),
        controller=Controller(law="pd", kp=column("kp"), kd=column("kd"), highpass=200.0,
                              lowpass=300.0, discretisation="tustin", sample_time=PERIOD,
                              command_resolution=2e-4 * column("kp")),
        encoder=Encoder(shaft_ratio=[10.0], resolution=column("lsb")),
        experiments={f"log-{j + 1}": Experiment(start=column("start")) for j in range(3)})
