"""An arm of two joints under the law of `my_law.py`: its logs and robot file, as an owner has.

python docs/laws/arm_to_try.py -o out/pid_arm --friction 0.02
clie diagnose out/pid_arm --run-law
"""

import argparse
import runpy
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.effects import LIBRARY
from clie_blocks.output import run_main
from clie_blocks.robot_loop import robot_loop

LAW = Path(__file__).parent / "my_law.py"
INERTIA, DAMPING = [2e-3, 8e-4], [5e-3, 2e-3]  # kg m^2, N m s/rad
NOISE = 2e-5  # rad
ROBOT = """name = "arm under PID"
joints = 2
[motor]
gear_ratio = [1.0, 1.0]
inertia_kgm2 = [0.002, 0.0008]
viscous_friction_nms = [0.005, 0.002]
[controller]
law = "my_law.py:controller"
sample_time_s = 0.001
"""


def motion(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """References of two joints [rad]: a few tones each, from zero."""
    tones = 2 * np.pi * rng.uniform(0.1, 2.0, (2, 5))
    waves = 0.8 / (1.0 + tones) * np.sin(np.multiply.outer(time, tones))
    return waves.sum(axis=2)


def write_logs(folder: Path, friction: float, seconds: float) -> None:
    """Simulate three experiments with dry friction at the first joint [N m], and write them."""
    law = runpy.run_path(str(LAW))["controller"]
    effects = [LIBRARY["coulomb"](level=[friction, 0.0])] if friction else []
    robot = compile_diagram(robot_loop(INERTIA, DAMPING, 0.0, 0.0, law.dt, law=law,
                                       effects=effects))
    rng, time = np.random.default_rng(3), np.arange(0.0, seconds, law.dt)
    folder.mkdir(parents=True, exist_ok=True)
    head = "time," + ",".join(f"{name}{k}" for name in ("q", "u", "qd") for k in (1, 2))
    for number in (1, 2, 3):
        q_d, noise = motion(rng, time), NOISE * rng.normal(size=(len(time), 2))
        run = robot.run(seconds, inputs=np.hstack([q_d, 0.0 * q_d, noise])).outputs
        q, u = run[:2, :len(time)].T + noise, run[2:4, :len(time)].T
        np.savetxt(folder / f"log-{number}.csv", np.hstack([time[:, None], q, u, q_d]), "%.9g",
                   ",", header=head, comments="")
    shutil.copy(LAW, folder / LAW.name)
    (folder / "robot.toml").write_text(ROBOT)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the logs of an arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--friction", type=float, default=0.0, metavar="NM",
                        help="dry friction of the first joint")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each log")
    args = parser.parse_args(argv)
    write_logs(args.output, args.friction, args.seconds)
    return 0


if __name__ == "__main__":
    run_main(main)
