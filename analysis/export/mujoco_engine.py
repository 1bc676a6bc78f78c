"""MuJoCo as an export uses it: a model compiled from text, and its mass matrix."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.errors import ClieError, MissingExtraError

if TYPE_CHECKING:
    import mujoco

LEAST_WEIGHT = 1e-6  # N m or N: bodies of a stub weigh less


def load(text: str, source: str, folder: Path | None = None) -> mujoco.MjModel:
    """Return a compiled model from the text of an MJCF.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    ClieError
        If MuJoCo refuses the model; says why.

    """
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("a MuJoCo model", "mujoco", "mujoco") from None
    try:
        spec = mujoco.MjSpec.from_string(text)
        if folder is not None:
            spec.modelfiledir = str(folder.resolve())
        return spec.compile()
    except ValueError as error:
        raise ClieError(f"MuJoCo {mujoco.__version__} refuses {source}: {error}") from None


def mass_matrix(compiled: mujoco.MjModel) -> np.ndarray:
    """Return the mass matrix in the pose in which the model begins."""
    import mujoco

    data, full = mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_forward(compiled, data)
    for k in range(compiled.nv):  # column by column: this call has one form in every version
        mujoco.mj_mulM(compiled, data, full[k], np.eye(compiled.nv)[k])
    return full


def free_inertia(compiled: mujoco.MjModel, dof: int) -> float:
    """Return what bodies bring about one joint while all others are free [kg m^2 or kg].

    An armature that takes off less than this leaves the mass matrix positive definite.
    """
    of_bodies = mass_matrix(compiled)
    of_bodies[dof, dof] -= compiled.dof_armature[dof]
    of_bodies += 1e-12 * np.eye(compiled.nv)  # two joints about one axis: none of them is free
    return float(1.0 / np.linalg.inv(of_bodies)[dof, dof])


def weighs(compiled: mujoco.MjModel) -> bool:
    """Whether gravity acts on a joint in the pose of the start, or a quarter turn off.

    Weight that the model compensates does not count.
    """
    import mujoco

    data = mujoco.MjData(compiled)
    for turned in (0.0, np.pi / 2):
        data.qpos[compiled.jnt_qposadr] = compiled.qpos0[compiled.jnt_qposadr] + turned
        mujoco.mj_forward(compiled, data)
        if np.any(np.abs(data.qfrc_bias - data.qfrc_gravcomp) > LEAST_WEIGHT):
            return True
    return False


def damps_springs(compiled: mujoco.MjModel) -> bool:
    """Whether its integrator is an implicit one, which damps the stiff spring of a gear."""
    import mujoco

    return compiled.opt.integrator in (mujoco.mjtIntegrator.mjINT_IMPLICIT,
                                       mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


def joint_type(compiled: mujoco.MjModel, name: str) -> str:
    """Return the type of a joint as an MJCF names it: ``hinge``, ``slide``, ``ball``, ``free``."""
    import mujoco

    place = int(compiled.joint(name).id)
    return mujoco.mjtJoint(int(compiled.jnt_type[place])).name.removeprefix("mjJNT_").lower()
