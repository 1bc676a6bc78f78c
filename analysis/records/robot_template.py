"""A robot file to start from: what a model or a log says, and what only the user can know."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clie_blocks.rigid_body.description import Description, Joint
from clie_blocks.rigid_body.model_file import describe, read_model
from clie_blocks.rigid_body.tree import Tree

MARK = "# ?"  # begins a line that only the user can write

_HEAD = """\
# Lines that begin with '# ?' are for you: take away the mark and write your numbers, or leave them
# as they are where you do not know. One value per joint, in the order of joint_names.
"""
_MOTOR = """\
[motor]                          # from the datasheets, on the motor side of the gear
# ? gear_ratio = {ratio}         # motor turns per joint turn; 1 for direct drive
# ? inertia_kgm2 = {one}         # of the rotors
# ? viscous_friction_nms = {one}
# ? peak_torque_nm = {one}
# ? inertia_tolerance = 0.1      # relative
# ? torque_offset_tolerance_nm = {one}
"""
_CONTROLLER = """\
[controller]                     # u = Kp (qd - q) - Kd v + pe, on the motor side
# ? Kp = {one}
# ? Kd = {one}
# ? velocity_of = "error"        # Kd damps the error of the velocity, not the velocity
# another law: law = "pid" with Ki, "cascade" with Kv, or a block of your own in a Python file,
# law = "my_law.py:controller"
# ? velocity_filter = "difference"   # or two_tap, exact, two_corner with its corners
# ? sample_time_s = 0.001
# ? u_is = "commanded"           # or "measured" behind the drive, or "computed" afterwards

[encoder]
# ? mounting = "joint side"      # or "motor side"
# ? resolution_rad = {one}
"""
_LINKS = """\
[links]                          # on the joint side, from CAD; or model = "arm.urdf"
# ? length_m = {one}
# ? mass_kg = {one}
# ? com_m = {one}                # from the joint, along the link
# ? inertia_kgm2 = {one}         # about the centre of mass
# ? mass_tolerance = 0.05        # relative, of every link
# ? com_tolerance_m = 0.005      # of every centre of mass
"""


def robot_text(name: str, joints: Sequence[str], links: str = "") -> str:
    """Text of a robot file for some joints, with what is known of their links."""
    one = _list([0.0] * len(joints))
    ratio = _list([100.0] * len(joints))
    named = ", ".join(f'"{joint}"' for joint in joints)
    return "\n".join((
        _HEAD, f'name = "{name}"\njoints = {len(joints)}\njoint_names = [{named}]\n',
        _MOTOR.format(one=one, ratio=ratio), links or _LINKS.format(one=one),
        _CONTROLLER.format(one=one)))


def robot_text_of_model(model: str | os.PathLike[str], folder: str | os.PathLike[str],
                        base: str | None = None, tip: str | None = None) -> str:
    """Text of a robot file for a URDF or MJCF file.

    Parameters
    ----------
    model : path-like
        The file.
    folder : path-like
        Folder of the robot file, from which the model is named.
    base, tip : str, optional
        Links of the model between which the joints move.

    Raises
    ------
    ClieError
        If the model cannot be read, or none of its joints moves.

    """
    model = Path(model)
    description = describe(model)
    tip = tip or _only_tip(description)
    links = read_model(model, base, tip)
    of_joints = {joint.name: joint for joint in description.joints}
    return robot_text(model.stem, links.names, _links_of_model(
        os.path.relpath(model, folder), base, tip, links, [of_joints[j] for j in links.names]))


def _only_tip(description: Description) -> str | None:
    """Link at the end of a chain without branches; None of a robot that has several ends."""
    carriers = {joint.parent for joint in description.joints}
    ends = [link for link in description.links if link not in carriers]
    return ends[0] if len(ends) == 1 else None


def _links_of_model(path: str, base: str | None, tip: str | None, links: Tree,
                    joints: Sequence[Joint]) -> str:
    lines = ["[links]                          # from the model; its meshes are never read",
             f'model = "{Path(path).as_posix()}"']
    if base:
        lines.append(f'base = "{base}"')
    lines.append(f'tip = "{tip}"                  # a load sits there' if tip else
                 f'{MARK} tip = "name of a link"  # the arm ends there, and a load sits there')
    signs, zeros = _list([1.0] * links.n), _list([0.0] * links.n)
    lines += [f"{MARK} sign = {signs}     # -1 where the log counts against the model",
              f"{MARK} zero_rad = {zeros}   # position in the model where the log reads 0",
              f"{MARK} mass_tolerance = 0.05  # relative, of every link",
              f"{MARK} com_tolerance_m = 0.005  # of every centre of mass",
              f"{MARK} payload_kg = 0.0       # that the robot always carries at the tip"]
    if not np.array_equal(links.gravity, (0.0, 0.0, -9.81)):
        lines.append(f"gravity_m_s2 = {_list(links.gravity)}")
    else:
        lines.append(f"{MARK} gravity_m_s2 = {_list(links.gravity)}  # in the frame of the base: "
                     "a wall or a ceiling turns it")
    damping = [joint.damping for joint in joints]
    if any(damping):
        lines.append(f"joint_viscous_friction_nms = {_list(damping)}")
    for what, values, unit in (
            ("dry friction", [joint.dry_friction for joint in joints], "N m"),
            ("largest torque", [joint.effort for joint in joints], "N m"),
            ("rotor behind the gear", [joint.armature for joint in joints], "kg m^2")):
        if any(value not in (0.0, np.inf) for value in values):
            lines.append(f"# the model states, on the joint side, {what}: {_list(values)} {unit}")
    return "\n".join(lines) + "\n"


def _list(values: Sequence[float] | np.ndarray) -> str:
    shown = (f"{value:.6g}" if value % 1 else f"{value:.1f}" for value in values)
    return f"[{', '.join(shown)}]"

