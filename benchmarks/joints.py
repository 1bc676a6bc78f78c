"""What an arm in space costs by its number of joints: to simulate, beside MuJoCo, and to diagnose.

    python benchmarks/joints.py               writes docs/arms_speed.md
    python benchmarks/joints.py -o FILE

The arm is one of seven axes that turn and bend in turn, cut after each joint.  Its logs come from
MuJoCo, so that what the diagnosis says can be right or wrong.
"""

import dataclasses
import platform
import tempfile
from pathlib import Path

import diagnosis
import mujoco
import numpy as np
from timing import markdown, seconds, write_page

from clie_blocks import gap
from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.robot import draw_articulated, draw_truth
from clie_blocks.analysis.blind.engine.spatial_links import LAYOUTS
from clie_blocks.analysis.blind.engine.world import build_model
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Trial
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.output import progress, run_main

SEVEN_AXES, PERIOD, STEPS, LANES = LAYOUTS[-1], 1e-3, 2000, 16
FAULTS = {"sound": 0.0, "dry friction": 30.0}  # that shifts a joint by so many milliradian


def drawn_arm(count):
    """Return an arm of so many joints, and its true parameters."""
    rng = np.random.default_rng(count)
    robot = dataclasses.replace(draw_articulated(rng, SEVEN_AXES.first(count)), period=PERIOD)
    return robot, draw_truth(rng, robot)


def write_logs(folder, count, duration, fault):
    """Write robot file, model file and three logs of an arm whose middle joint has a fault."""
    robot, truth = drawn_arm(count)
    truth["level"][count // 2] = 1e-3 * FAULTS[fault] * robot.kp[count // 2]
    rng, time = np.random.default_rng(count), PERIOD * np.arange(round(duration / PERIOD))[:, None]
    experiments = [Experiment(name, robot.pose, robot.pose + q_d + 0 * time, robot.kp * pe)
                   for name, q_d, pe in _motions(rng, time, count)]
    noises = [robot.sigma * rng.standard_normal(one.q_d.shape) for one in experiments]
    runs = [run(robot, [truth], [one], [noise])[0] for one, noise in zip(experiments, noises)]
    write_trial(Trial(robot, experiments, runs, {}), folder)


def _motions(rng, time, count):
    """Name, offset of the reference [rad] and torque over Kp [rad] of three experiments."""
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / rng.uniform(5, 11, count)))
    lines = np.geomspace(0.06, 3.0, 9)[:, None] * rng.uniform(0.9, 1.1, (9, count))
    multisine = np.sin(2 * np.pi * time[..., None] * lines.T + rng.uniform(0, 6, (count, 9)))
    chirp = np.sin(2 * np.pi * rng.uniform(0.8, 1.2, count) * (0.1 * time + time**2 / 30))
    return (("triangle", 0.35 * triangle, 0.0 * triangle),
            ("multisine", 0.0 * chirp, 0.1 * multisine.sum(axis=2)),
            ("chirp", 0.0 * chirp, 0.3 * chirp))


def step_times(folder, count):
    """Return the time of a step [us] of MuJoCo, of the sampled loop alone, and side by side."""
    robot, truth = drawn_arm(count)
    model = build_model(robot, [truth])
    data = mujoco.MjData(model)
    data.qpos[:] = robot.pose
    data.ctrl[:] = robot.links.weight(robot.pose) / robot.ratio
    problem = gap.read(folder, trust_logs=True)
    loop, log = build_hypothesis(problem, ()), problem.logs[0]
    values = loop.of_log(0)
    jobs = (lambda: mujoco.mj_step(model, data, STEPS), lambda: loop.simulator.run(log, values),
            lambda: loop.simulator.positions(log, [values] * LANES))
    for job in jobs:
        job()
    mujoco_time, alone, lanes = (min(seconds(job) for _ in range(5)) for job in jobs)
    return 1e6 * mujoco_time / STEPS, 1e6 * alone / len(log), 1e6 * lanes / len(log) / LANES


def tables(duration, most):
    """Return the two tables, for one joint to so many."""
    steps, answers = [], []
    with tempfile.TemporaryDirectory() as name, progress("arms", most) as advance:
        folder = Path(name)
        for count in range(1, most + 1):
            row = [str(count)]
            for fault in FAULTS:
                place = folder / f"{count}-{fault.replace(' ', '-')}"
                write_logs(place, count, duration, fault)
                for _ in range(2):  # the first run compiles
                    said = diagnosis.apart(place, cache=folder / "programs")
                row += [f"{said['seconds']:.1f}", f"{said['memory']:.0f}", said["answer"]]
            theirs, alone, lanes = step_times(place, count)
            steps.append([str(count), f"{theirs:.1f}", f"{alone:.2f}", f"{lanes:.2f}",
                          f"{theirs / alone:.1f}", f"{theirs / lanes:.1f}"])
            answers.append(row)
            advance(1)
    head = [part for fault in FAULTS for part in (f"{fault}, s", "MB", "answer")]
    return (markdown(["joints", "MuJoCo, us", "sampled loop, us", f"{LANES} side by side, us each",
                      "ratio", "ratio side by side"], steps),
            markdown(["joints", *head], answers))


def document(duration=30.0, most=7):
    """Return the page."""
    steps, answers = tables(duration, most)
    return PAGE.format(steps=steps, answers=answers, duration=duration,
                       machine=diagnosis.machine(), python=platform.python_version(),
                       mujoco=mujoco.__version__, load=diagnosis.load())


PAGE = """\
# Computing time of an arm in space

Written by `python benchmarks/joints.py`; do not edit.

An arm of seven axes, cut after each joint, with all of its coupling and weight.  One core of
{machine}, Python {python}, MuJoCo {mujoco}.
{load}

## A step of 1 ms

MuJoCo steps the arm alone, by its fourth-order method; the sampled loop of the diagnosis steps
arm, drives, encoders, velocity filter and control law, by the midpoint rule, twice.  Each is the
least of five.

{steps}

## A diagnosis

Three logs of {duration:g} s at 1000 Hz made in MuJoCo, masses off by up to the 5 % that the robot
file states, the whole library; processor time from start-up to answer, in a process of its own
that finds its programs compiled.

{answers}
"""


def main(argv=None):
    """Write the page."""
    write_page(__doc__, "arms_speed.md", document, argv)


if __name__ == "__main__":
    run_main(main)
