"""Make the example log of an arm of servos, in MuJoCo: ``python docs/example_servo_arm.py``.

The arm is the SO-101 of the gallery.  A computer sends set-points to its servos every 10 ms and
logs them beside the positions, and nothing else.  Each servo acts on its position error at 1 kHz
and is damped by its motor; neither its gain nor its rotor is published.  The elbow rubs.
"""

import argparse
import dataclasses
import gzip
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.records.gallery import gallery_files
from clie_blocks.errors import MissingExtraError
from clie_blocks.output import run_main, write

NAME, JOINTS, ELBOW = "servo-arm", 6, 2
STIFFNESS = np.array([16.0, 18.0, 17.0, 15.0, 16.0, 14.0])  # N m/rad, joint side
ROTOR, DRAG, FRICTION = 0.028, 0.9, 0.15  # kg m^2, N m s/rad, N m, joint side; in no robot file
LOOP, ROW, SUBSTEPS = 1e-3, 0.01, 4  # s, s, and steps of the engine in one of the servo
SECONDS, LOGS = 10.0, 2
STEP, NOISE = 2 * np.pi / 4096, 2e-4  # rad
TONES = np.array([0.17, 0.29, 0.47, 0.71, 1.1, 1.6])  # Hz
POSE = np.array([0.0, -0.4, 0.5, 0.3, 0.0, 0.5])  # rad


@dataclasses.dataclass(frozen=True)
class ServoArm:
    """The arm with what its owner does not know.

    Parameters
    ----------
    friction : mapping of int to float
        Dry friction by joint [N m].
    is_sent : bool
        A computer sends the set-points; else the servos make the motion themselves.

    """

    friction: Mapping[int, float] = dataclasses.field(default_factory=dict)
    is_sent: bool = True

    def _model(self) -> Any:
        try:
            import mujoco
        except ImportError:
            raise MissingExtraError("this arm", "MuJoCo", "mujoco") from None
        model = mujoco.MjModel.from_xml_string(gallery_files("so101", "")["so101.urdf"])
        model.opt.timestep = LOOP / SUBSTEPS
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model.dof_armature[:], model.dof_damping[:], model.jnt_limited[:] = ROTOR, DRAG, 0
        for k, level in self.friction.items():
            model.dof_frictionloss[k] = level
        return model

    def run(self, seed: int, seconds: float = SECONDS) -> dict[str, np.ndarray]:
        """Time, set-points and positions of one motion, a row per 10 ms."""
        model, rng = self._model(), np.random.default_rng(seed)
        import mujoco

        phases = rng.uniform(0.0, 2 * np.pi, (JOINTS, len(TONES)))
        sizes = 0.05 * rng.uniform(0.7, 1.3, phases.shape) / TONES**0.7
        data, rows, goal = mujoco.MjData(model), [], POSE
        data.qpos[:] = POSE
        for tick in range(round(seconds / LOOP)):
            is_row = tick % round(ROW / LOOP) == 0
            if is_row or not self.is_sent:
                turn = 2 * np.pi * TONES * tick * LOOP + phases
                goal = np.round(POSE + (sizes * (np.sin(turn) - np.sin(phases))).sum(axis=1), 4)
            q = STEP * np.rint((data.qpos + NOISE * rng.standard_normal(JOINTS)) / STEP)
            if is_row:
                rows.append((tick * LOOP, goal, q))
            data.qfrc_applied[:] = STIFFNESS * (goal - q)
            mujoco.mj_step(model, data, SUBSTEPS)
        return dict(zip(("time", "qd", "q"), map(np.array, zip(*rows))))

    def write_logs(self, folder: Path, logs: int = LOGS) -> None:
        """Write logs as the owner has them."""
        names = ["time", *(f"{name}{k + 1}" for name in ("qd", "q") for k in range(JOINTS))]
        for number in range(1, logs + 1):
            rows = np.column_stack([*self.run(number).values()])
            text = "\n".join([",".join(names), *(",".join(f"{value:.5g}" for value in row)
                                                 for row in rows), ""])
            write(folder / f"log-{number}.csv.gz", gzip.compress(text.encode(), mtime=0))


def make(folder: Path) -> None:
    """Write the robot file of the gallery, its URDF and the logs."""
    for name, text in gallery_files("so101", "robot.toml").items():
        write(folder / name, text)
    ServoArm({ELBOW: FRICTION}).write_logs(folder)


def main(argv: Sequence[str] | None = None) -> None:
    """Write the example."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("-o", "--output", default=FOLDER / NAME, type=Path, metavar="DIR",
                         help="folder of the example")
    folder = options.parse_args(argv).output
    make(folder)
    print(folder)


if __name__ == "__main__":
    run_main(main)
