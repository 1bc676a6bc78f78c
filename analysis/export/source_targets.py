"""Targets that are source text around the core of a joint: python-control, Drake, Simulink."""

from __future__ import annotations

import dataclasses

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import INPUTS, OUTPUTS, joint_block


@dataclasses.dataclass(frozen=True)
class SourceTarget:
    """One such target.

    Parameters
    ----------
    template : str
        Template of the file of a joint.
    file : str
        Its name, with ``{name}`` for the joint.
    in_c : bool
        Whether it calls the C file, which is then written beside it.
    ran : str
        What was checked, and where.

    """

    template: str
    file: str
    in_c: bool
    ran: str


SOURCE_TARGETS = {
    "python-control": SourceTarget(
        "python_control.py.j2", "{name}_control.py", False,
        "The tests of this package run such blocks in python-control."),
    "drake": SourceTarget(
        "drake.py.j2", "{name}_drake.py", False,
        "The tests of this package run such systems in Drake where pydrake is installed."),
    "simulink": SourceTarget(
        "s_function.c.j2", "{name}_sfun.c", True,
        "The tests of this package compile and run such S-functions against a stand-in for "
        "simstruc.h; they were never run in Simulink."),
}


def export_source(correction: Correction, step: float, target: str) -> Exported:
    """Return the source of every joint.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    step : float
        Sample time of the blocks [s].
    target : str
        One of `SOURCE_TARGETS`.

    """
    how = SOURCE_TARGETS[target]
    files: dict[str, str | bytes] = {}
    for k in range(len(correction.joints)):
        made = core(joint_block(correction, k, step))
        files[how.file.format(name=made.name)] = _text(made, how)
        if how.in_c:
            files |= {f"{made.name}.c": made.c_source(), f"{made.name}.h": made.c_header()}
    return Exported(target, files, notes(correction), ran=how.ran)


def _text(made: Core, how: SourceTarget) -> str:
    words = made.name.split("_")
    return fill(how.template, core=made, inputs=INPUTS, outputs=OUTPUTS,
                upper=made.name.upper(), numbers=[value for _, value in made.parameters],
                class_name="".join(word[:1].upper() + word[1:] for word in words))
