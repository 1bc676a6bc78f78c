"""Make the example log of a leg, in MuJoCo: ``python docs/example_leg.py``.

The leg is that of the gallery, with the trunk held.  Its law runs in the drives; the log holds
what such robots send, positions and their references, and no torque.  Its thigh rubs.
"""

import argparse
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.records.gallery import gallery_files
from clie_blocks.errors import MissingExtraError
from clie_blocks.output import run_main, write

NAME, JOINTS = "leg-without-torque", ("hip", "thigh", "calf")
PERIOD, SECONDS, SUBSTEPS = 0.005, 10.0, 10
KP, KD = 20.0, 1.5  # N m/rad, N m s/rad
ROTOR = np.array([0.00448, 0.00448, 0.0165])  # kg m^2, joint side
DRAG = np.array([0.10, 0.10, 0.10])  # N m s/rad
FRICTION = np.array([0.0, 0.4, 0.0])  # N m, dry; in no robot file
POSE = np.array([0.1, 0.8, -1.5])  # rad
STEP, NOISE = 1e-4, 1e-4  # rad
HEAD = f"""# {NAME}: an example of clie, made in MuJoCo by docs/example_leg.py
# Front left leg of a Unitree Go2, with the trunk held, as 'clie robot go2-leg' writes it, with
# gains, damping and tolerances as its owner knows them. The logs hold positions and no torque.
"""


def robot_file() -> str:
    """Text of the robot file: that of the gallery, with what its owner knows besides."""
    text = gallery_files("go2-leg", "robot.toml")["robot.toml"]
    known = {"Kp": [KP] * 3, "Kd": [KD] * 3, "sample_time_s": PERIOD, "inertia_tolerance": 0.02,
             "viscous_friction_nms": DRAG.tolist(), "torque_offset_tolerance_nm": [0.05] * 3,
             "resolution_rad": [STEP] * 3}
    lines = []
    for line in text[text.index("name ="):].splitlines():
        if not line.startswith("# ? "):
            lines.append(line)
        elif (key := line.removeprefix("# ? ").partition(" = ")[0]) in known:
            lines.append(f"{key} = {known[key]}")
    law = 'velocity_filter = "difference"\nhold = "zero-order"\n\n[encoder]'
    return HEAD + "\n".join(lines).replace("\n[encoder]", law) + "\n"


def references(t: np.ndarray) -> list[np.ndarray]:
    """Slow sines, quick ones, and moves between poses, which are held out [rad]."""
    tones = np.array([[0.3, 0.5, 0.41], [1.1, 0.8, 1.3]])
    slow, quick = (sum(0.35 / (1 + k) * np.sin(2 * np.pi * f * t[:, None] * (1, 1.31, 0.83)[k])
                       for k in range(3)) for f in tones)
    poses = np.random.default_rng(5).uniform(-0.4, 0.4, (7, 3))
    s = np.clip((t % 1.6) / 1.0, 0.0, 1.0)[:, None]
    lap = (t // 1.6).astype(int)
    here, then = poses[lap % 7], poses[(lap + 1) % 7]
    moves = here + s**3 * (10 - 15 * s + 6 * s**2) * (then - here)
    return [POSE + fade(t) * motion for motion in (slow, 0.6 * quick, moves)]


def fade(t: np.ndarray) -> np.ndarray:
    """Start of a motion from rest, as a column."""
    return np.minimum(t / 0.5, 1.0)[:, None]


def run(q_d: np.ndarray, seed: int) -> np.ndarray:
    """Measured positions of the leg under its law [rad], one row per reference."""
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("this leg", "MuJoCo", "mujoco") from None
    model = mujoco.MjModel.from_xml_string(gallery_files("go2-leg", "")["go2-leg.urdf"])
    model.opt.timestep = PERIOD / SUBSTEPS
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.dof_armature[:], model.dof_damping[:], model.jnt_limited[:] = ROTOR, DRAG, 0
    model.dof_frictionloss[:] = FRICTION
    model.dof_solref[:], model.dof_solimp[:] = (0.002, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    data.qpos[:], before, rows = POSE, None, []
    for goal in q_d:
        q = STEP * np.round((data.qpos + NOISE * rng.standard_normal(3)) / STEP)
        before = q if before is None else before
        data.qfrc_applied[:] = KP * (goal - q) - KD * (q - before) / PERIOD
        before = q
        rows.append(q)
        mujoco.mj_step(model, data, SUBSTEPS)
    return np.array(rows)


def make(folder: Path) -> None:
    """Write the robot file, its URDF and the logs."""
    t = PERIOD * np.arange(round(SECONDS / PERIOD))
    head = ",".join(["time", *(f"{name}_{joint}" for name in ("q", "qd") for joint in JOINTS)])
    for number, q_d in enumerate(references(t), 1):
        rows = np.column_stack([t, run(np.round(q_d, 4), number), np.round(q_d, 4)])
        text = "\n".join([head, *(",".join(f"{value:.6g}" for value in row) for row in rows), ""])
        write(folder / f"log-{number}.csv.gz", gzip.compress(text.encode(), mtime=0))
    files = gallery_files("go2-leg", "robot.toml")
    write(folder / "go2-leg.urdf", files["go2-leg.urdf"])
    write(folder / "robot.toml", robot_file())


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
