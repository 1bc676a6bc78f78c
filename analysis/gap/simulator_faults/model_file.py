"""What a simulator's own model file, an MJCF, says of joints and drives, and in which lines."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.export.mjcf_elements import actuators_of, in_words, joints_of
from clie_blocks.analysis.export.mujoco_engine import load
from clie_blocks.analysis.export.xml_text import Element, XmlText
from clie_blocks.errors import ClieError, RecordError, nearest
from clie_blocks.rigid_body.model_file import read_model

if TYPE_CHECKING:
    import mujoco

    from clie_blocks.rigid_body.tree import Tree


@dataclasses.dataclass(frozen=True, eq=False)
class ModelFile:
    """Joints and drives of an MJCF, joint side where not said otherwise, arrays of shape (n,).

    Parameters
    ----------
    path : Path
        The file.
    document : XmlText
        Its elements.
    joints : tuple of str
        Names, in the order of the logs.
    armature, damping, friction : ndarray
        Of the joints [kg m^2, N m s/rad, N m].
    stiffness, rest : ndarray
        Springs of the joints [N m/rad, rad].
    limit : ndarray
        Largest control of each drive that takes a torque; infinite without one.
    delay : ndarray
        From a control to its effect [s].
    step : float
        Of the integrator [s].

    """

    path: Path
    document: XmlText
    joints: tuple[str, ...]
    armature: np.ndarray
    damping: np.ndarray
    friction: np.ndarray
    stiffness: np.ndarray
    rest: np.ndarray
    limit: np.ndarray
    delay: np.ndarray
    step: float

    def joint(self, k: int) -> Element:
        """Return the element of joint k."""
        return joints_of(self.document)[self.joints[k]]

    def drive(self, k: int) -> Element | None:
        """Return the actuator of joint k; None where none is written for it."""
        return next((one for one in actuators_of(self.document)
                     if one.attributes.get("joint") == self.joints[k]), None)

    def section(self, name: str) -> Element | None:
        """Return an element right below the root, such as the options."""
        return self.document.root.child(name)

    @functools.cached_property
    def tree_of_geoms(self) -> Tree | None:
        """Links whose masses are those of their geoms; None where they are the same or unknown."""
        if not any(True for _ in self.document.root.every("inertial")):
            return None
        changed = XmlText(self.path.read_text(), str(self.path))
        compiler = changed.root.child("compiler")
        if compiler is None:
            changed.insert_before(changed.root.children[0], '<compiler inertiafromgeom="true"/>')
        else:
            changed.set(compiler, {"inertiafromgeom": "true"})
        with TemporaryDirectory() as folder:
            copy = Path(folder) / "geoms.xml"
            copy.write_text(changed.text)
            try:
                return read_model(copy, joints=self.joints)
            except ClieError:  # a mesh, say, of which no mass is known
                return None


def read_model_file(path: str | PathLike[str], joints: Sequence[str]) -> ModelFile:
    """Read what an MJCF says of the joints of a log, as MuJoCo understands it.

    Parameters
    ----------
    path : path-like
        The file.
    joints : sequence of str
        Names, in the order of the logs.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    RecordError
        If the file cannot be read, or a joint is not in it.
    ClieError
        If MuJoCo refuses the file.

    """
    path, joints = Path(path), tuple(joints)
    document, text = _read(path)
    for name in joints:
        if name not in joints_of(document):
            raise RecordError(
                f"{in_words(document, str(path))} has no joint {name!r}, which the logs hold; "
                f"{nearest(name, list(joints_of(document)))}. Name the joints in robot.toml as in "
                "the model, joint_names = [...]")
    compiled = load(text, str(path), path.parent)
    ids = [int(compiled.joint(name).id) for name in joints]
    dofs = compiled.jnt_dofadr[ids]
    return ModelFile(
        path, document, joints, compiled.dof_armature[dofs], compiled.dof_damping[dofs],
        compiled.dof_frictionloss[dofs], compiled.jnt_stiffness[ids],
        compiled.qpos_spring[compiled.jnt_qposadr[ids]],
        np.array([_limit(compiled, k) for k in ids]), np.array([_delay(compiled, k) for k in ids]),
        float(compiled.opt.timestep))


def _drive(compiled: mujoco.MjModel, joint: int) -> int | None:
    """Number of the actuator of a joint that takes a torque; None without one."""
    found = np.flatnonzero((compiled.actuator_trnid[:, 0] == joint)
                           & (compiled.actuator_trntype == 0) & (compiled.actuator_biastype == 0))
    return int(found[0]) if len(found) else None


def _limit(compiled: mujoco.MjModel, joint: int) -> float:
    """Largest control that a joint gets, by all that limits it."""
    drive = _drive(compiled, joint)
    if drive is None:
        return np.inf
    gain, gear = compiled.actuator_gainprm[drive, 0], compiled.actuator_gear[drive, 0]
    limits = [
        (compiled.actuator_ctrllimited[drive], compiled.actuator_ctrlrange[drive, 1]),
        (compiled.actuator_forcelimited[drive], compiled.actuator_forcerange[drive, 1] / gain),
        (compiled.jnt_actfrclimited[joint],
         compiled.jnt_actfrcrange[joint, 1] / abs(gain * gear))]
    return min((float(limit) for is_limited, limit in limits if is_limited), default=np.inf)


def _delay(compiled: mujoco.MjModel, joint: int) -> float:
    """Delay of the actuator of a joint [s]; engines before 3.5 have none."""
    drive = _drive(compiled, joint)
    known = drive is not None and hasattr(compiled, "actuator_delay")
    return float(compiled.actuator_delay[drive]) if known else 0.0


def _read(path: Path) -> tuple[XmlText, str]:
    """Elements and text of a file."""
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"{path} cannot be read ({error}); name the MJCF that the simulator "
                          "was to run") from None
    document = XmlText(text, str(path))
    if document.root.name != "mujoco":
        raise RecordError(f"{path} begins with <{document.root.name}>, not with <mujoco>: an MJCF "
                          "is needed; MuJoCo writes one of a URDF, mujoco.mj_saveLastXML")
    return document, text
