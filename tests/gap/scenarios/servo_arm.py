"""A desk arm of hobby servos in MuJoCo: its set-points and positions are logged, and nothing else.

A computer sends a set-point every 10 ms.  Each servo acts on its position error at 1 kHz and is
damped by its motor; neither its gain nor its rotor is published.
"""

import dataclasses
from pathlib import Path

import mujoco
import numpy as np

JOINTS = 6
STIFFNESS = np.array([16.0, 18.0, 17.0, 15.0, 16.0, 14.0])  # N m/rad at the joint
ROTOR, DRAG = 0.028, 0.9  # kg m^2 and N m s/rad, behind the gear
LOOP, LOGGED, FINE = 1e-3, 0.01, 4  # s, s, and steps of the engine in one of the servo
STEP, NOISE = 2 * np.pi / 4096, 2e-4  # rad
FREQUENCIES = np.array([0.17, 0.29, 0.47, 0.71, 1.1, 1.6])  # Hz
HOME = np.array([0.0, -0.4, 0.5, 0.3, 0.0, 0.5])  # rad


@dataclasses.dataclass(frozen=True)
class ServoArm:
    """The arm of a model file, with what its owner does not know.

    Parameters
    ----------
    urdf : Path
        The model.
    coulomb : dict of int to float
        Dry friction of a joint [N m].
    sends : bool
        A computer sends the set-points; else the servo itself makes the motion.

    """

    urdf: Path
    coulomb: dict[int, float] = dataclasses.field(default_factory=dict)
    sends: bool = True

    def model(self) -> mujoco.MjModel:
        """The engine's model: rotors, drag and friction act behind the gears."""
        model = mujoco.MjModel.from_xml_path(str(self.urdf))
        model.opt.timestep = LOOP / FINE
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model.dof_armature[:], model.dof_damping[:], model.jnt_limited[:] = ROTOR, DRAG, False
        for k, level in self.coulomb.items():
            model.dof_frictionloss[k] = level
        return model

    def run(self, seconds: float, seed: int) -> dict[str, np.ndarray]:
        """Time, set-points and positions of one motion."""
        rng = np.random.default_rng(seed)
        phases = rng.uniform(0.0, 2 * np.pi, (JOINTS, len(FREQUENCIES)))
        sizes = 0.05 * rng.uniform(0.7, 1.3, phases.shape) / FREQUENCIES**0.7
        model = self.model()
        data, rows = mujoco.MjData(model), []
        data.qpos[:] = HOME
        for tick in range(round(seconds / LOOP)):
            is_row = tick % round(LOGGED / LOOP) == 0
            if is_row or not self.sends:
                turn = 2 * np.pi * FREQUENCIES * tick * LOOP + phases
                goal = HOME + (sizes * (np.sin(turn) - np.sin(phases))).sum(axis=1)
            read = STEP * np.rint((data.qpos + NOISE * rng.standard_normal(JOINTS)) / STEP)
            if is_row:
                rows.append((tick * LOOP, goal, read))
            data.qfrc_applied[:] = STIFFNESS * (goal - read)
            mujoco.mj_step(model, data, nstep=FINE)
        return dict(zip(("time", "qd", "q"), map(np.array, zip(*rows))))

    def write_logs(self, folder: Path, seconds: float = 10.0, count: int = 2) -> None:
        """Logs as their owner has them."""
        for seed in range(1, count + 1):
            signals = self.run(seconds, seed)
            names = ["time", *(f"{name}{k + 1}" for name in ("qd", "q") for k in range(JOINTS))]
            np.savetxt(folder / f"log-{seed}.csv", np.column_stack([*signals.values()]),
                       delimiter=",", fmt="%.8g", header=",".join(names), comments="")
