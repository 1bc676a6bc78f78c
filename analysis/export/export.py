"""A correction brought to a target: `export`, from an answer or a diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike

from clie_blocks.analysis.export.c_target import export_c
from clie_blocks.analysis.export.correction import Correction, check_joint_names
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.fmu import export_fmu
from clie_blocks.analysis.export.gazebo_target import export_gazebo
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.analysis.export.simscape import export_simscape
from clie_blocks.analysis.export.source_targets import SOURCE_TARGETS, export_source
from clie_blocks.errors import ClieError, nearest

TARGETS: dict[str, str] = {
    "mujoco": "your MJCF, patched, and a Python module for what it has no words for",
    "ros2-control": "one chainable controller of ROS 2 per joint, as a package",
    "isaac": "an actuator class of Isaac Lab for all joints, in PyTorch",
    "newton": "native functions of Warp for all joints, one thread per world",
    "c": "one self-contained C99 function per joint",
    "fmu": "one FMI 3.0 co-simulation unit per joint",
    "python-control": "one sampled block per joint, as a Python module",
    "drake": "one LeafSystem per joint, as a Python module",
    "gazebo": "your SDF, patched, and one system plugin of Gazebo Sim per joint",
    "modelica": "one Modelica model per joint, which calls its C function",
    "simulink": "one level-2 S-function in C per joint",
    "simscape": "one component in the Simscape language per joint, for effects without memory",
}
DEFAULT_STEP = 1.25e-4  # s, of the blocks in C; a whole fraction of the period of the controller


def export(correction: Correction, target: str, model: str | PathLike[str] | None = None,
           renamed: Mapping[str, str] | None = None, step: float | None = None) -> Exported:
    """Return a correction as files of a target.

    Parameters
    ----------
    correction : Correction
        From `read_correction`, or of a diagnosis.
    target : str
        One of `TARGETS`.
    model : path-like, optional
        The user's own model, which ``mujoco`` and ``gazebo`` patch.
    renamed : dict of str to str, optional
        Name in the model by name in the logs; where no model is given, in the files.
    step : float, optional
        Step of the simulator [s]; that of MuJoCo stands in the model.

    Raises
    ------
    ClieError
        For an unknown target, a model that the target cannot patch, or an unknown joint.

    """
    if target not in TARGETS:
        raise ClieError(f"no target {target!r}; {nearest(target, TARGETS)}")
    check_joint_names(tuple(renamed or ()), correction.names, "the answer")
    if target == "mujoco":
        if step is not None:
            raise ClieError("the step of a MuJoCo model stands in the model: set its option "
                            "timestep and leave out --step")
        return export_mujoco(correction, model, renamed)
    if target == "gazebo":
        return export_gazebo(correction, None if step is None else _step(correction, step), model,
                             renamed)
    if model is not None:
        raise ClieError(f"the target {target!r} patches no model; leave out --model, and call the "
                        "block from your simulator")
    correction = correction.renamed(renamed or {})
    if target in SOURCE_TARGETS:
        if step is None and SOURCE_TARGETS[target].at_controller:
            step = correction.period
        return export_source(correction, _step(correction, step), target)
    blocks: dict[str, Callable[[Correction, float], Exported]] = {
        "c": export_c, "fmu": export_fmu, "simscape": export_simscape}
    return blocks[target](correction, _step(correction, step))


def _step(correction: Correction, step: float | None) -> float:
    """Step of the blocks: as wanted, or a fraction of the period that is short enough."""
    if step is None:
        return correction.period / max(1, -int(-correction.period // DEFAULT_STEP))
    if not 0.0 < step <= correction.period * (1 + 1e-9):
        raise ClieError(f"--step {step:g} s: the controller runs every {correction.period:g} s, "
                        "and the step of a simulator is that or a fraction of it")
    return step
