"""A six-axis arm in MuJoCo, sound or with faults: its logs, robot file and model as an owner has.

    python docs/arms/six_axis_robot.py -o out/sound
    python docs/arms/six_axis_robot.py --friction elbow=6 --masses-off 0.04 -o out/rubs

The engine reads the URDF; drives, noise, rounding and a sampled PD law are written out below.
"""

import argparse
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.errors import ClieError, MissingExtraError
from clie_blocks.output import progress, run_main

ARM = Path(__file__).parent / "six_axis.urdf"
JOINTS = "shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"
PERIOD, SUBSTEPS = 1e-3, 2  # s, engine steps per period
RATIO = np.full(6, 100.0)
ROTOR = np.array([2e-4, 2e-4, 2e-4, 5e-5, 5e-5, 5e-5])  # kg m^2
FRICTION = np.array([4e-3, 4e-3, 4e-3, 1e-3, 1e-3, 1e-3])  # N m s/rad
HOME = np.array([0.0, -1.0, 1.2, -1.5, -1.5, 0.3])
BANDWIDTH = 2 * np.pi * np.array([3.0, 3.0, 3.0, 4.0, 4.0, 4.0])  # rad/s
ENCODER_STEP, NOISE = 2.5e-5, 2e-5  # rad
CORNERS = 200.0, 300.0  # rad/s of the velocity filter


class SixAxisRobot:
    """The arm with some faults, which writes logs and a robot file as its owner would.

    Parameters
    ----------
    coulomb : mapping of int to float
        Dry friction of joints [N m], joint side.
    gain : mapping of int to float
        Delivered over commanded torque of joints.
    payload : float
        Mass at the flange [kg].
    masses : sequence of float
        Mass and inertia of each link over those in the file.
    centres : mapping of int to sequence of float
        By how much the centres of mass of links lie beside those in the file [m].
    tilt : float
        Angle by which the base leans about its x axis [rad].
    command_step : float
        To which commands are rounded [N m].
    seed : int
        Of noise and motions.

    """

    def __init__(self, coulomb: Mapping[int, float] | None = None,
                 gain: Mapping[int, float] | None = None, payload: float = 0.0,
                 masses: Sequence[float] = (1.0,) * 6,
                 centres: Mapping[int, Sequence[float]] | None = None, tilt: float = 0.0,
                 command_step: float = 2e-5, seed: int = 0) -> None:
        try:
            import mujoco
        except ImportError:
            raise MissingExtraError("this arm", "MuJoCo", "mujoco") from None
        self.engine, self.rng = mujoco, np.random.default_rng(seed)
        self.command_step = command_step
        model = mujoco.MjModel.from_xml_string(ARM.read_text())
        model.opt.timestep = PERIOD / SUBSTEPS
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        model.opt.gravity[:] = 0.0, -9.81 * np.sin(tilt), -9.81 * np.cos(tilt)
        model.jnt_limited[:] = 0
        model.dof_armature[:], model.dof_damping[:] = RATIO**2 * ROTOR, RATIO**2 * FRICTION
        for body, share in enumerate(masses, 1):
            model.body_mass[body] *= share
            model.body_inertia[body] *= share
        for link, shift in (centres or {}).items():
            model.body_ipos[link + 1] += shift
        if payload:
            self._carry(model, payload)
        for k, torque in (coulomb or {}).items():
            model.dof_frictionloss[k] = torque
            model.dof_solref[k] = 2 * PERIOD, 1.0
            model.dof_solimp[k] = 0.9999, 0.9999, 0.001, 0.5, 2.0
        self.gain = np.ones(6)
        for k, share in (gain or {}).items():
            self.gain[k] = share
        self.model, self.data = model, mujoco.MjData(model)
        mujoco.mj_setConst(model, self.data)

    def _carry(self, model: Any, mass: float) -> None:
        """Add a point mass at the flange to the last body."""
        last, place = model.nbody - 1, np.array([0.0, 0.0, 0.0823])
        own, com = model.body_mass[last], model.body_ipos[last].copy()
        whole = own + mass
        centre = (own * com + mass * place) / whole
        for part, at in ((own, com), (mass, place)):
            x, y, z = at - centre
            model.body_inertia[last] += part * np.array([y * y + z * z, x * x + z * z,
                                                         x * x + y * y])
        model.body_mass[last], model.body_ipos[last] = whole, centre

    def write(self, folder: Path, seconds: float = 20.0, links: str = "") -> Path:
        """Write three logs, the robot file with lines for [links], and the URDF."""
        folder.mkdir(parents=True, exist_ok=True)
        kp, kd = _gains(self.engine)
        head = "time," + ",".join(f"{name}{k}" for name in ("q", "qd", "u") for k in range(1, 7))
        with progress("logs", len(MOTIONS)) as advance:
            for number, motion in enumerate(MOTIONS, 1):
                rows = self._run(motion(self.rng, np.arange(0.0, seconds, PERIOD)), kp, kd)
                np.savetxt(folder / f"log-{number}.csv", rows, "%.9g", ",", header=head,
                           comments="")
                advance(1)
        shutil.copy(ARM, folder / "arm.urdf")
        (folder / "robot.toml").write_text(
            _robot_file(kp, kd, self.command_step, links))
        return folder

    def _run(self, q_d: np.ndarray, kp: np.ndarray, kd: np.ndarray) -> np.ndarray:
        """Rows of time, positions, references and commands of one experiment."""
        from scipy.signal import bilinear

        low, high = CORNERS
        b, a = bilinear([low * high, 0.0], np.poly([-low, -high]), 1.0 / PERIOD)
        self.engine.mj_resetData(self.model, self.data)
        self.data.qpos[:] = HOME
        rows, memory, start = [], np.zeros((2, 6)), None
        for i, goal in enumerate(q_d):
            noisy = self.data.qpos + NOISE * self.rng.normal(size=6)
            q = ENCODER_STEP * np.round(noisy / ENCODER_STEP)
            start = q if start is None else start
            rate = b[0] * (q - start) + memory[0]
            memory = np.array([b[1] * (q - start) - a[1] * rate + memory[1],
                               b[2] * (q - start) - a[2] * rate])
            u = kp * (goal - q) - kd * rate
            u = self.command_step * np.round(u / self.command_step)
            rows.append(np.concatenate(([i * PERIOD], q, goal, u)))
            self.data.qfrc_applied[:] = RATIO * self.gain * u
            for _ in range(SUBSTEPS):
                self.engine.mj_step(self.model, self.data)
        return np.array(rows)


def _gains(engine: Any) -> tuple[np.ndarray, np.ndarray]:
    """Gains for the bandwidth, with the inertia of the sound arm at home."""
    model = engine.MjModel.from_xml_string(ARM.read_text())
    model.dof_armature[:] = RATIO**2 * ROTOR
    data, mass = engine.MjData(model), np.zeros((6, 6))
    data.qpos[:] = HOME
    engine.mj_forward(model, data)
    engine.mj_fullM(model, data, mass)
    inertia = mass.diagonal() / RATIO
    return np.round(inertia * BANDWIDTH**2, 3), np.round(1.6 * inertia * BANDWIDTH, 3)


Motion = Callable[[np.random.Generator, np.ndarray], np.ndarray]


def _triangles(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    q_d = np.tile(HOME, (len(time), 1))
    for k in range(6):
        phase = (time / rng.uniform(5.0, 12.0)) % 1.0
        q_d[:, k] += np.radians(rng.uniform(18, 30)) * np.interp(
            phase, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    return q_d


def _sines(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    q_d, fade = np.tile(HOME, (len(time), 1)), np.minimum(time / 0.5, 1.0)
    for k in range(6):
        for f in np.geomspace(0.06, 2.0, 8) * rng.uniform(0.9, 1.1, 8):
            size = np.radians(rng.uniform(1, 6)) * min(1.0, 0.4 / f)
            q_d[:, k] += fade * size * np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi))
    return q_d


def _chirps(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    q_d, fade, duration = np.tile(HOME, (len(time), 1)), np.minimum(time / 0.5, 1.0), time[-1]
    for k in range(6):
        last = rng.uniform(1.0, 2.0)
        cycles = 0.05 * time + (last - 0.05) * time**2 / (2 * duration)
        q_d[:, k] += fade * np.radians(6) * np.sin(2 * np.pi * cycles) * np.clip(
            1.5 - time / duration, 0.3, 1.0)
    return q_d


MOTIONS: tuple[Motion, ...] = (_triangles, _sines, _chirps)


def _robot_file(kp: np.ndarray, kd: np.ndarray, command_step: float, links: str) -> str:
    def listed(values: np.ndarray) -> str:
        return f"[{', '.join(f'{value:.9g}' for value in values)}]"

    return f"""name = "six-axis arm"
joints = 6
joint_names = {json.dumps(JOINTS)}
[motor]
gear_ratio = {listed(RATIO)}
inertia_kgm2 = {listed(ROTOR)}
viscous_friction_nms = {listed(FRICTION)}
inertia_tolerance = 0.01
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = 0.02
[links]
model = "arm.urdf"
tip = "flange"
{links}
[controller]
Kp = {listed(kp)}
Kd = {listed(kd)}
velocity_filter_highpass_rad_s = {CORNERS[0]}
velocity_filter_lowpass_rad_s = {CORNERS[1]}
velocity_filter_discretisation = "tustin"
sample_time_s = {PERIOD}
hold = "zero-order"
command_resolution_nm = {command_step}
[encoder]
mounting = "joint side"
resolution_rad = {ENCODER_STEP}
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Write the folder of an arm."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out/six_axis"), metavar="DIR",
                        help="folder to write")
    parser.add_argument("--seconds", type=float, default=20.0, help="length of each log")
    parser.add_argument("--friction", metavar="JOINT=NM", help="dry friction, joint side")
    parser.add_argument("--payload", type=float, default=0.0, metavar="KG", help="at the flange")
    parser.add_argument("--masses-off", type=float, default=0.0, metavar="SHARE",
                        help="links are heavier and lighter in turn, and the robot file states "
                             "that tolerance")
    options = parser.parse_args(argv)
    off = options.masses_off
    robot = SixAxisRobot(coulomb=_at_joint(options.friction) if options.friction else {},
                         payload=options.payload, masses=1.0 + off * np.resize((1.0, -1.0), 6))
    robot.write(options.output, options.seconds, f"mass_tolerance = {off}" if off else "")
    print(f"logs, robot.toml and arm.urdf: {options.output}")
    return 0


def _at_joint(text: str) -> dict[int, float]:
    """Read ``elbow=6``."""
    name, _, value = text.partition("=")
    try:
        return {JOINTS.index(name): float(value)}
    except ValueError:
        raise ClieError(f"--friction {text}: say a joint and a torque, as elbow=6; joints: "
                        f"{', '.join(JOINTS)}") from None


if __name__ == "__main__":
    run_main(main)
