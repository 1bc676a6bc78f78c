"""A robot file to start from: what a model or a log says, and what only the user can know."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.checks.measures import step_size
from clie_blocks.analysis.records.law_of_log import LawOfLog, law_of_logs
from clie_blocks.analysis.records.model import DEFAULT_UNITS, Record
from clie_blocks.analysis.records.robot_keys import SCHEMA
from clie_blocks.errors import ClieError
from clie_blocks.output import counted
from clie_blocks.rigid_body.description import Description, Joint
from clie_blocks.rigid_body.model_file import describe, read_model
from clie_blocks.rigid_body.tree import Tree

MARK = "# ?"  # begins a line that only the user can write

_HEAD = f"""\
#:schema ./{SCHEMA}
# Lines that begin with '# ?' are for you: take away the mark and write your numbers, or leave them
# as they are where you do not know. One value per joint, in the order of joint_names.
"""
_GEAR = """\
# ? gear_ratio = {ratio}         # motor turns per joint turn; 1 for direct drive
# a wrist whose motors turn several joints: motor_coupling = [[1, 0], [0.5, 1]], row k says by how
# much each motor turns joint k, over its gear ratio
# ? inertia_kgm2 = {one}         # of the rotors"""
_MOTOR = """\
[motor]                          # from the datasheets, on the motor side of the gear
{gear}
# ? viscous_friction_nms = {one}
# ? peak_torque_nm = {one}
# ? inertia_tolerance = 0.1      # relative
# ? torque_offset_tolerance_nm = {one}
"""
_CONTROLLER = """\
[controller]                     # u = Kp (qd - q) - Kd v + pe, on the motor side
{law}
"""
_LAW = """\
# ? Kp = {one}
# ? Kd = {one}
# ? velocity_of = "error"        # Kd damps the error of the velocity, not the velocity
# another law: law = "pid" with Ki, "cascade" with Kv, or a block of your own in a Python file,
# law = "my_law.py:controller", or a function in C, law = "my_law.c:controller"
# ? velocity_filter = "difference"   # or two_tap, exact, two_corner with its corners
# ? sample_time_s = 0.001
# ? u_is = "commanded"           # or "measured" behind the drive, or "computed" afterwards"""
_ENCODER = """\
[encoder]
# ? mounting = "joint side"      # or "motor side"
{resolution}
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


def robot_text(name: str, joints: Sequence[str], links: str = "", law: str = "",
               resolution: str = "", units: str = "", gear: str = "") -> str:
    """Text of a robot file, with what is known of gears, links, law, encoder and units."""
    one = _list([0.0] * len(joints))
    ratio = _list([100.0] * len(joints))
    named = ", ".join(f'"{joint}"' for joint in joints)
    return "\n".join((
        _HEAD, f'name = "{name}"\njoints = {len(joints)}\njoint_names = [{named}]\n',
        _MOTOR.format(one=one, gear=gear or _GEAR.format(one=one, ratio=ratio)),
        links or _LINKS.format(one=one),
        _CONTROLLER.format(law=law or _LAW.format(one=one)),
        _ENCODER.format(resolution=resolution or f"{MARK} resolution_rad = {one}"))) + units


def robot_text_of_logs(name: str, records: Sequence[Record]) -> str:
    """Text of a robot file with what logs show: joints, law, encoder steps and units.

    Parameters
    ----------
    name : str
        Of the robot.
    records : sequence of Record
        Its logs.

    """
    return robot_text(name, records[0].joints, **_of_logs(records))


def _of_logs(records: Sequence[Record]) -> dict[str, str]:
    """Law, encoder and units that logs show, as parts of a robot file."""
    first, law = records[0], law_of_logs(records)
    one, period = _list([0.0] * first.n), f"sample_time_s = {first.sample_time:.4g}"
    guess = _LAW.format(one=one).replace(f"{MARK} sample_time_s = 0.001",
                                         f"{period}   # the rate of the logs")
    rounding = () if first.u is None else _steps("command_resolution", first.u)
    lines = [*(_law_lines(law) if law else (guess,)), *rounding]
    key = "resolution_m" if set(first.units["q"]) == {"m"} else "resolution_rad"
    return {"law": "\n".join(lines), "resolution": "".join(_steps(key, first.q)),
            "units": _units(first)}


def _law_lines(law: LawOfLog) -> Iterator[str]:
    """Lines of a law that was found; marked where it leaves a part of the commands."""
    stated, mark = law.controller, "" if law.is_certain else f"{MARK} "
    yield (f"# found in the logs: it leaves {100 * law.share:.2g} % of the commands"
           + ("" if law.is_certain else ", so that it is not quite the one that ran"))
    values = {"Kp": stated.kp, "Kd": stated.kd}
    yield from (f"{mark}{key} = [{', '.join(f'{value:.4g}' for value in gains)}]"
                for key, gains in values.items() if gains is not None)
    yield f'{mark}velocity_filter = "{stated.velocity_filter}"'
    if stated.corners:
        yield f"{mark}velocity_filter_highpass_rad_s = {stated.corners[0]:.3g}"
        yield f"{mark}velocity_filter_lowpass_rad_s = {stated.corners[1]:.3g}"
        yield f'{mark}velocity_filter_discretisation = "{stated.discretisation}"'
    yield f"{mark}sample_time_s = {stated.sample_time}"


def _steps(key: str, signal: np.ndarray) -> list[str]:
    """Line of the steps that a signal comes in, as a list of one, or of none without steps."""
    steps = [step_size(signal[:, k]) for k in range(signal.shape[1])]
    if not np.isfinite(steps).all():
        return []
    return [f"{key} = [{', '.join(f'{step:.4g}' for step in steps)}]   # the steps of the logs"]


def _units(record: Record) -> str:
    """Section of the units that are others than usual, or that no column names."""
    units = {signal: unit if isinstance(unit, str) else unit[0]
             for signal, unit in record.units.items() if signal in ("q", "u")}
    lines = [f'{signal} = "{unit}"' for signal, unit in units.items()
             if unit != DEFAULT_UNITS[signal]]
    lines += [f'{MARK} {signal} = "{units[signal]}"   # taken, since no column names a unit'
              for signal in ("q", "u")
              if any(f"No unit is stated for {signal};" in note for note in record.decisions)]
    return "\n".join(["\n[units]", *lines, ""]) if lines else ""


def robot_text_of_model(model: str | os.PathLike[str], folder: str | os.PathLike[str],
                        base: str | None = None, tip: str | None = None,
                        records: Sequence[Record] = ()) -> str:
    """Text of a robot file for a URDF or MJCF file.

    Parameters
    ----------
    model : path-like
        The file.
    folder : path-like
        Folder of the robot file, from which the model is named.
    base, tip : str, optional
        Links of the model between which the joints move.
    records : sequence of Record, optional
        Logs of the robot, for the law and what else they show.

    Raises
    ------
    ClieError
        If the model cannot be read, none of its joints moves, or the logs have other joints.

    """
    model = Path(model)
    description = describe(model)
    tip = tip or _only_tip(description)
    links = read_model(model, base, tip)
    by_name = {joint.name: joint for joint in description.joints}
    joints = [by_name[name] for name in links.names]
    if records and records[0].n != links.n:
        raise ClieError(f"{records[0].source} has {counted(records[0].n, 'joint')}, and {model} "
                        f"{links.n} that move, {', '.join(links.names)}; name the links between "
                        "which the robot moves with --base and --tip")
    return robot_text(
        model.stem, links.names,
        _links_of_model(os.path.relpath(model, folder), base, tip, links, joints),
        gear=_gears_of_model(joints), **(_of_logs(records) if records else {}))


def _gears_of_model(joints: Sequence[Joint]) -> str:
    """Lines on gears and rotors where a model states its motors; empty where it does not."""
    gears = np.array([joint.gear for joint in joints])
    if np.all(gears == 1.0) or not np.all(gears):
        return ""
    rotors = [joint.armature for joint in joints] / gears**2
    inertia = (f"inertia_kgm2 = {_list(rotors)}   # the armatures of the model" if np.all(rotors)
               else f"{MARK} inertia_kgm2 = {_list(0.0 * gears)}         # of the rotors")
    return (f"gear_ratio = {_list(np.abs(gears))}   # the model's motors; 1 where u acts on the "
            f"joint\n{inertia}")


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

