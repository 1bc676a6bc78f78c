"""The target ``c``: one self-contained C99 file with its header per corrected joint."""

from __future__ import annotations

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import joint_block, why_no_block


def export_c(correction: Correction, step: float) -> Exported:
    """Return one C99 file and one header per joint.

    Each function holds everything between the command and the torque on the joint: drive, viscous
    and dry friction, offset and effects; the inertia stays in the simulator, and the header says
    how large it is.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    step : float
        Step at which the functions are called [s].

    """
    files: dict[str, str | bytes] = {}
    for k in range(len(correction.joints)):
        made = core(joint_block(correction, k, step))
        files[f"{made.name}.c"], files[f"{made.name}.h"] = made.c_source(), made.c_header()
    return Exported("c", files, notes(correction),
                    ran="The block is checked against python-control at random points.")


def notes(correction: Correction) -> tuple[str, ...]:
    """What the user of a block must know: the inertia of the joint, and what is left out."""
    n = len(correction.joints)
    found = []
    for k, joint in enumerate(correction.joints):
        unit = "kg" if joint.slides else "kg m^2"
        where = " beside its links" if joint.links_known else ""
        value = joint.beside_links if joint.links_known else joint.inertia
        motor = joint_block(correction, k, correction.period).motor_inertia
        inside = f"; {motor:.6g} {unit} more is the motor's, which the block moves"
        found.append(f"Give {joint.name} an inertia of {value - motor:.6g} {unit}{where}"
                     f"{inside if motor else ''}.")
        if joint_block(correction, k, correction.period).reads_load:
            found.append(f"Friction of {joint.name} grows with what its gear carries: give it "
                         f"the weight of the links as tau_other [{joint.unit_torque}], the torque "
                         "with which they turn the joint; without it that friction is left out.")
        found += [f"Left out at {joint.name}: {one!r}; {why}." for one in correction.at(k)
                  if (why := why_no_block(one, n))]
    return (*found, *correction.common_notes)
