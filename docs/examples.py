"""Make the example logs that `clie example` ships, in MuJoCo: ``python docs/examples.py``.

The robot is the same in all: a planar arm of two links that hang in gravity, each behind a gear,
under a sampled PD law.  What it hides is written in `EXAMPLES`; its labels are no secret.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.parameters import healthy_parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Trial
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.output import run_main, write

SECONDS, PERIOD = 8.0, 2e-3
HEAD = "# {title}: an example of clie, made in MuJoCo by docs/examples.py\n"
EXAMPLES = {  # true parameters beside those of the datasheet, motor side
    "friction-arm": {"level": [0.0, 0.004]},  # N m, dry friction of the elbow
    "healthy-arm": {}}


def robot() -> DrawnRobot:
    """Return the arm as its robot file states it."""
    ratio = np.array([100.0, 50.0])
    return DrawnRobot(
        "arm", PERIOD, gravity=True, coupling=True, ratio=ratio, rotor=np.array([5e-5, 3e-5]),
        drag=np.array([1.5e-4, 8e-5]), length=np.array([0.4, 0.3]), mass=np.array([2.0, 1.0]),
        com=np.array([0.2, 0.15]), inertia=np.array([0.02, 0.006]),
        bearing=np.array([0.3, 0.05]), pose=np.array([-0.8, 0.6]), kp=np.array([1.0, 0.22]),
        kd=np.array([0.16, 0.036]), corners=(200.0, 300.0), discretisation="tustin",
        command_step=np.array([5e-4, 1e-4]), resolution=np.full(2, 1e-4),
        sigma=np.array([8e-5, 8e-5]), shaft=10.0)


def experiments(arm: DrawnRobot) -> list[Experiment]:
    """Slow triangles, an injected multisine, and moves between poses, which are held out."""
    t = PERIOD * np.arange(round(SECONDS / PERIOD))[:, None]
    triangle = 0.35 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / [4.0, 2.7]))
    tones = np.geomspace(0.15, 3.0, 6)
    phase = np.pi * np.arange(6) ** 2 / 6
    waves = np.stack([np.sin(2 * np.pi * t * tones * share + phase).sum(axis=1)
                      for share in (1.0, 1.07)], axis=1)
    poses = np.array([[0.0, 0.0], [0.35, -0.4], [-0.2, 0.3], [0.3, 0.4], [-0.3, -0.2], [0.1, 0.1]])
    lap, inside = np.divmod(t[:, 0], 1.6)
    s = np.clip(inside / 1.1, 0.0, 1.0)[:, None]
    here, then = poses[lap.astype(int)], poses[lap.astype(int) + 1 - len(poses)]
    moves = here + s**3 * (10 - 15 * s + 6 * s**2) * (then - here)
    torque = 0.12 * arm.kp * np.minimum(t / 0.5, 1.0) * waves
    return [_experiment(arm, "triangle", triangle, 0.0 * t),
            _experiment(arm, "multisine", 0.0 * t, torque),
            _experiment(arm, "other", moves, 0.0 * t)]


def _experiment(arm: DrawnRobot, kind: str, offset: np.ndarray, torque: np.ndarray) -> Experiment:
    q_d = np.round(arm.pose + offset, 4)
    pe = np.broadcast_to(np.round(torque / arm.command_step) * arm.command_step, q_d.shape)
    return Experiment(kind, arm.pose.copy(), np.broadcast_to(q_d, pe.shape), pe)


def make(name: str, folder: Path) -> None:
    """Run the arm with what it hides, and write its robot file and logs."""
    arm, rng = robot(), np.random.default_rng(1)
    truth = healthy_parameters(2) | {
        "rotor": 1.004 * arm.rotor, "drag": arm.drag * np.array([1.08, 0.94]),
        "offset": 0.01 * arm.kp * np.array([0.5, -0.3])}
    truth |= {key: np.array(value) for key, value in EXAMPLES[name].items()}
    runs = experiments(arm)
    noises = [arm.sigma * rng.standard_normal(one.q_d.shape) for one in runs]
    write_trial(Trial(arm, runs, run(arm, [truth] * 3, runs, noises), {}), folder)
    text = (folder / "robot.toml").read_text()
    write(folder / "robot.toml", HEAD.format(title=name) + text.replace(
        "joints = 2\n", 'joints = 2\njoint_names = ["shoulder", "elbow"]\n'))


def main(argv: Sequence[str] | None = None) -> None:
    """Write every example."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("-o", "--output", default=FOLDER, type=Path, metavar="DIR",
                         help="folder for the examples")
    folder = options.parse_args(argv).output
    for name in EXAMPLES:
        make(name, folder / name)
        print(folder / name)


if __name__ == "__main__":
    run_main(main)
