"""The target ``gazebo``: a system of Gazebo Sim per joint, and the user's SDF that loads them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from xml.sax.saxutils import quoteattr

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core
from clie_blocks.analysis.export.correction import Correction, check_basis
from clie_blocks.analysis.export.exported import Exported, read_model, unified_diff
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.analysis.export.mujoco_split import split
from clie_blocks.analysis.export.sdf_model import KINDS, patch, plugin, read_sdf, step_of
from clie_blocks.analysis.export.source_targets import SourceTarget
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import ClieError

FILES = SourceTarget(
    {"{name}_gazebo.cc": "gazebo.cc.j2"},
    "The tests of this package compile and run such systems against a stand-in for the headers "
    "of Gazebo Sim; they were never run in Gazebo.",
    of_robot={"CMakeLists.txt": "gazebo_cmake.txt.j2"}, commanded="<command_per_force>")
DEFAULT_STEP = 1e-3  # s, of Gazebo Sim where a world states none


def export_gazebo(correction: Correction, step: float | None,
                  model: str | PathLike[str] | None = None,
                  renamed: Mapping[str, str] | None = None) -> Exported:
    """Return the correction as systems of Gazebo Sim.

    Plain Coulomb friction is the joint's own ``<friction>``, which holds it at rest without creep;
    everything else is the block's, viscous friction too.

    Parameters
    ----------
    correction : Correction
        What to bring in.
    step : float or None
        Step of the blocks [s]; by default the engine's.
    model : path-like, optional
        The user's SDF, of the robot or of a world; by default a snippet is written.
    renamed : dict of str to str, optional
        Name in the model by name in the logs.

    Raises
    ------
    ClieError
        As in `patch`; if the engine's step is no fraction of that of the blocks; or if motors turn
        several joints.

    """
    if correction.shares is not None:
        raise ClieError("an SDF has no motor that turns several joints (motor_coupling); give "
                        "--to mujoco, or a target whose blocks you call at the motors, such as c")
    if model is None:
        step = min(correction.period, DEFAULT_STEP) if step is None else step
        cores, friction = _cores(correction, step)
        files = FILES.files(cores) | {"joints.sdf": _snippet(cores, friction)}
        return Exported("gazebo", files, _notes(correction, cores), ran=FILES.ran)
    path = Path(model)
    check_basis(correction, path.name)
    text = read_model(path, "the SDF of the robot", "a snippet")
    document = read_sdf(text, path.name)
    step = _step(correction, step, step_of(document), path.name)
    cores, friction = _cores(correction, step)
    patched = patch(document, path.name, cores, friction, renamed or {})
    name = f"{path.stem}.corrected.sdf"
    diff = unified_diff(text, patched, path.name, name)
    files = FILES.files(cores) | {name: patched, f"{path.stem}.original.sdf": text,
                                  f"{path.stem}.diff": diff}
    return Exported("gazebo", files, _notes(correction, cores), diff, FILES.ran)


def in_engine(correction: Correction, k: int) -> tuple[Setting, ...]:
    """Effects of joint k that the engine holds: Coulomb friction that is all its dry friction."""
    found = split(correction, k)
    native = tuple(one for one in found.native if one.effect.name in (
        "coulomb", "asymmetric_coulomb"))
    alone = len(native) == 1 and native[0].effect.name == "coulomb"
    return native if alone and found.gear is None else ()


def _cores(correction: Correction, step: float) -> tuple[list[Core], list[float]]:
    """Block of each joint, and the dry friction that is left to the engine [N m or N]."""
    cores, friction = [], []
    for k, joint in enumerate(correction.joints):
        held = in_engine(correction, k)
        cores.append(core(joint_block(correction, k, step, [
            one for one in correction.at(k) if one not in held], sees_links=False)))
        vectors = [one.vectors(len(correction.joints))["level"] for one in held]
        friction.append(sum(joint.torque * float(level[k if len(level) > 1 else 0])
                            for level in vectors))
    return cores, friction


def _step(correction: Correction, wanted: float | None, engine: float | None,
          source: str) -> float:
    """Step of the blocks, a whole number of the engine's."""
    step = wanted or min(engine or DEFAULT_STEP, correction.period)
    if engine is not None and abs(step / engine - max(1, round(step / engine))) > 1e-6:
        raise ClieError(f"{source} takes steps of {engine:g} s, and the blocks steps of {step:g} "
                        "s, which are no whole number of them: set <max_step_size> to a fraction "
                        f"of the controller's period of {correction.period:g} s, or give --step")
    return step


def _snippet(cores: Sequence[Core], friction: Sequence[float]) -> str:
    """What belongs into the user's SDF."""
    lines = ['<model name="yours">', "  <!-- Into the joints of your model; its damping goes. -->"]
    for made, level in zip(cores, friction, strict=True):
        name, kind = made.block.joint.name, KINDS[made.block.joint.kind][0]
        lines += [f'  <joint name={quoteattr(name)} type="{kind}">', "    <axis>",
                  f"      <dynamics><damping>0</damping><friction>{level:.9g}</friction>"
                  "</dynamics>", "    </axis>", "  </joint>"]
    lines.append("  <!-- Behind the plugins of your controller. -->")
    lines += [f"  {line}" for made in cores
              for line in plugin(made, made.block.joint.name).splitlines()]
    return "\n".join([*lines, "</model>", ""])


def _notes(correction: Correction, cores: Sequence[Core]) -> tuple[str, ...]:
    told = notes(dataclasses.replace(correction, of_links=()))
    by_motor = [f"{name} takes the torque of the motor for the load of the gear, which the logs "
                "show to be the weight of the links: Gazebo Sim does not tell a system that "
                "weight." for name in correction.of_links]
    return (*told, *by_motor, *FILES.notes(cores),
            "Each <plugin> must stand behind those of your controller: systems run in the order "
            "of the file.")
