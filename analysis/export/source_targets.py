"""Targets that are source text around the core of a joint, in the words of a simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import joint_block


@dataclasses.dataclass(frozen=True)
class SourceTarget:
    """One such target.

    Parameters
    ----------
    of_joint : dict of str to str
        Template of each file of a joint, by the name of the file with ``{name}`` for the joint.
    ran : str
        What was checked, and where.
    in_c : bool
        Whether it calls the C file, which is then written beside it.
    of_robot : dict of str to str
        Template of each file that holds all joints, by its name.

    """

    of_joint: Mapping[str, str]
    ran: str
    in_c: bool = True
    of_robot: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def files(self, cores: Sequence[Core]) -> dict[str, str | bytes]:
        """Return the files of some joints."""
        files: dict[str, str | bytes] = {}
        for made in cores:
            files |= {name.format(name=made.name): fill(template, core=made)
                      for name, template in self.of_joint.items()}
            if self.in_c:
                files |= {f"{made.name}.c": made.c_source(), f"{made.name}.h": made.c_header()}
        return files | {name: fill(template, cores=cores)
                        for name, template in self.of_robot.items()}


SOURCE_TARGETS = {
    "python-control": SourceTarget(
        {"{name}_control.py": "python_control.py.j2"},
        "The tests of this package run such blocks in python-control.", in_c=False),
    "drake": SourceTarget(
        {"{name}_drake.py": "drake.py.j2"},
        "The tests of this package run such systems in Drake where pydrake is installed.",
        in_c=False),
    "simulink": SourceTarget(
        {"{name}_sfun.c": "s_function.c.j2"},
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
    cores = [core(joint_block(correction, k, step)) for k in range(len(correction.joints))]
    return Exported(target, how.files(cores), notes(correction), ran=how.ran)
