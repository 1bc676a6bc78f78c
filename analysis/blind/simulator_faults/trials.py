"""Trials of the study: the files of a simulator, and logs of a run with a fault."""

import dataclasses
import io
from pathlib import Path

import numpy as np

from clie_blocks.analysis.blind.simulator_faults.injected import DELAY, DELAYED, INJECTED
from clie_blocks.analysis.blind.simulator_faults.joint import (
    PERIOD,
    Joint,
    draw_joint,
    experiments,
)
from clie_blocks.analysis.blind.simulator_faults.run import model_text, simulate
from clie_blocks.output import write

MODEL, ROBOT = "joint.xml", "robot.toml"


def robot_text(joint: Joint) -> str:
    """Robot file of a joint."""
    return f"""name = "joint"
joints = 1
joint_names = ["hinge"]
[motor]
gear_ratio = [{joint.gear!r}]
[links]
model = "{MODEL}"
[controller]
Kp = [{joint.kp!r}]
Kd = [{joint.kd!r}]
velocity_filter = "difference"
sample_time_s = {PERIOD}
"""


def write_trial(folder: Path, name: str, seed: int, index: int) -> None:
    """Write the files of a simulator with a fault, and its logs.

    Parameters
    ----------
    folder : Path
        Where they go.
    name : str
        Of the fault, one of `INJECTED`.
    seed, index : int
        Of the random numbers.

    """
    rng = np.random.default_rng([seed, index])
    joint = draw_joint(rng)
    motions = experiments(rng, joint)
    if name in DELAYED:
        joint = dataclasses.replace(joint, delay=DELAY)
    run = INJECTED[name](rng, joint)
    write(folder / MODEL, model_text(joint))
    write(folder / ROBOT, robot_text(joint))
    for k, (q_d, pe) in enumerate(motions, 1):
        table = io.StringIO()
        np.savetxt(table, simulate(joint, run, q_d, pe), delimiter=",", fmt="%.9g",
                   header="time,q1,u1,qd1,pe1", comments="")
        write(folder / f"log-{k}.csv", table.getvalue())
