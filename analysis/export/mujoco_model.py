"""The target ``mujoco``: the user's MJCF with the correction in it, or a stub of its own."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from clie_blocks.analysis.export.correction import Correction, Joint, check_joint_names
from clie_blocks.analysis.export.mujoco_split import NEEDS, TINY, Split, armature, split
from clie_blocks.analysis.export.xml_text import Element, XmlText
from clie_blocks.errors import ClieError, MissingExtraError

if TYPE_CHECKING:
    import mujoco

SAME = 0.01  # relative: a control of the user's actuator is then the logged command
LONGEST_STEP = 1.25e-4  # s, of a stub: dry friction then holds as in the corrected model
TORQUE_ACTUATORS = ("motor", "general")


@dataclasses.dataclass(frozen=True)
class Driven:
    """How a corrected joint is driven in the model.

    Parameters
    ----------
    joint : str
        Joint on which motor and friction act.
    link : str
        Joint of the link: another one behind an elastic gear.
    actuator : str
        Its actuator; empty where none takes a torque.
    control : float
        Control of the actuator per unit of the logged command.
    offset : float
        Constant torque that no actuator holds, as none is there [N m].

    """

    joint: str
    link: str
    actuator: str
    control: float
    offset: float = 0.0


@dataclasses.dataclass(frozen=True)
class CorrectedModel:
    """A corrected MJCF.

    Parameters
    ----------
    text : str
        The file.
    step : float
        Its time step [s].
    splits : tuple of Split
        How the effects of each joint were brought in.
    driven : tuple of Driven
        How each joint is driven.
    notes : tuple of str
        What the user must know: what is left out, and why.

    """

    text: str
    step: float
    splits: tuple[Split, ...]
    driven: tuple[Driven, ...]
    notes: tuple[str, ...]

    @property
    def needs_module(self) -> bool:
        """Whether a block must run beside the model."""
        return any(one.block for one in self.splits) or any(one.offset for one in self.driven)


def stub(correction: Correction) -> str:
    """Text of a model to be corrected where the user has none: one body per joint, side by side.

    Its bodies have next to no mass; links, where they are known, are in the model of the report.
    """
    step = correction.period / math.ceil(correction.period / LONGEST_STEP - 1e-9)
    bodies = "\n".join(
        f'    <body pos="0 {k} 0">\n'
        f'      <inertial pos="0 0 0" mass="{TINY}" diaginertia="{TINY} {TINY} {TINY}"/>\n'
        f'      <joint name={quoteattr(joint.name)} type="{joint.kind}" '
        f'axis="{"0 1 0" if joint.slides else "0 -1 0"}"/>\n    </body>'
        for k, joint in enumerate(correction.joints))
    motors = "\n".join(
        f'    <general name={quoteattr(joint.name)} joint={quoteattr(joint.name)} '
        f'gear="{_before(joint, "gear"):.9g}" gainprm="{_before(joint, "gain"):.9g}"/>'
        for joint in correction.joints)
    return (f'<mujoco model="joints">\n  <compiler angle="radian" autolimits="true"/>\n'
            f'  <option timestep="{step:.9g}" integrator="RK4" gravity="0 0 0"/>\n'
            f'  <worldbody>\n{bodies}\n  </worldbody>\n  <actuator>\n{motors}\n  </actuator>\n'
            '</mujoco>\n')


def corrected_model(correction: Correction, text: str, source: str,
                    folder: Path | None = None,
                    renamed: Mapping[str, str] | None = None) -> CorrectedModel:
    """Return an MJCF with the correction in it; all else of the text stays as it stands.

    Parameters
    ----------
    correction : Correction
        What to bring in.
    text : str
        The MJCF.
    source : str
        What to call it in a message.
    folder : Path, optional
        Where its meshes and included files are.
    renamed : dict of str to str, optional
        Name in the model by name in the logs, of joints that are called otherwise.

    Raises
    ------
    ClieError
        If the model lacks a joint, drives one by a set-point although the drive is corrected, or
        the installed MuJoCo lacks a word that the correction needs.
    RecordError
        If the text is no MJCF.
    MissingExtraError
        If MuJoCo is not installed.

    """
    if correction.basis != "datasheet":
        raise ClieError(
            f"{source} cannot be patched from this answer: it was compared with the logs of your "
            f"own {correction.basis}, and says what to add to it; the .xml next to the report "
            "lists the changes. Diagnose without --simulated for a model that can be exported")
    document = XmlText(text, source)
    if document.root.name != "mujoco":
        raise ClieError(f"{source} begins with <{document.root.name}>, and an MJCF with <mujoco>; "
                        "give the MJCF of the robot (MuJoCo converts a URDF)")
    names = {name: (renamed or {}).get(name, name) for name in correction.names}
    check_joint_names(tuple(names.values()), tuple(_joints(document)), _whole(document, source))
    compiled = load(text, source, folder)
    patch = _Patch(correction, document, compiled, names, source)
    patched = patch.apply()
    load(patched.text, f"the corrected {source}", folder)
    return patched


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


class _Patch:
    """The edits of one model."""

    def __init__(self, correction: Correction, document: XmlText, compiled: mujoco.MjModel,
                 names: Mapping[str, str], source: str) -> None:
        self.correction, self.document, self.compiled = correction, document, compiled
        self.names, self.source = names, source
        self.step = float(compiled.opt.timestep)
        self.notes: list[str] = list(_notes(correction))
        self.tail: list[str] = []  # sections behind all others

    def apply(self) -> CorrectedModel:
        """Edit every joint, and return the model."""
        splits = tuple(split(self.correction, k) for k in range(len(self.correction.joints)))
        self._check_version(splits)
        driven = tuple(self._joint(one) for one in splits)
        ticks = self.correction.period / self.step
        if abs(ticks - round(ticks)) > 1e-6 * ticks or ticks < 0.5:
            self.notes.append(
                f"The controller runs every {self.correction.period:g} s, which is no whole "
                f"number of the model's time steps of {self.step:g} s: set option timestep to a "
                "fraction of it.")
        if self.tail:
            self.document.append(self.document.root, "\n".join(self.tail))
        return CorrectedModel(self.document.text, self.step, splits, driven, tuple(self.notes))

    def _check_version(self, splits: Sequence[Split]) -> None:
        import mujoco

        version = tuple(int(part) for part in mujoco.__version__.split(".")[:2])
        for one in splits:
            for setting in one.native:
                needed = NEEDS.get(setting.effect.name, (0, 0))
                if version < needed:
                    raise ClieError(
                        f"MuJoCo {mujoco.__version__} has no word for {setting.effect.name} at "
                        f"{one.joint.name}: it came with {needed[0]}.{needed[1]}; update it: pip "
                        'install -U "clie-blocks[mujoco]"')

    def _joint(self, piece: Split) -> Driven:
        """Edit one joint and its actuator."""
        name = self.names[piece.joint.name]
        element = _joints(self.document)[name]
        dof = int(self.compiled.joint(name).dofadr[0])
        found = piece.joint_attributes(self.step)
        inertia = self._armature(piece, element, dof)
        if piece.stiffness:
            rest = piece.spring_rest
            self.document.set(element, {"stiffness": piece.stiffness,
                                        "springref": rest if self._is_radian(piece.joint)
                                        else math.degrees(rest)})
        for setting in piece.bodies:
            self._payload(setting)
        motor = name
        if piece.gear is None:
            self.document.set(element, {"armature": inertia, **found})
        else:
            motor = self._elastic(piece, element, name, inertia, found)
        for setting, why in piece.left:
            self.notes.append(f"Left out at {name}: {setting!r}; {why}.")
        return self._actuator(piece, name, motor)

    def _armature(self, piece: Split, element: Element, dof: int) -> float:
        of_bodies = None
        if not piece.joint.links_known:
            of_bodies = float(_mass(self.compiled)[dof, dof] - self.compiled.dof_armature[dof])
        inertia = armature(piece, of_bodies)
        if inertia >= 0.0:
            return inertia
        body = element.parent
        inertial = next((one for one in body.children if one.name == "inertial"), None
                        ) if body else None
        if piece.joint.slides and inertial is not None and "mass" in inertial.attributes:
            mass = float(inertial.attributes["mass"]) + inertia
            if mass > 0.0:
                self.document.set(inertial, {"mass": mass})
                return 0.0
        unit = "kg" if piece.joint.slides else "kg m^2"
        self.notes.append(
            f"The bodies of the model bring {-inertia:.6g} {unit} more about "
            f"{piece.joint.name} than the logs show ({piece.joint.inertia:.6g} {unit}); its "
            "armature is 0 now, and the masses of the bodies need a look.")
        return 0.0

    def _elastic(self, piece: Split, element: Element, name: str, inertia: float,
                 found: Mapping[str, float | str]) -> str:
        """Put the motor on a joint of its own, and the spring of the gear between the two."""
        motor, joint = f"{name}_motor", piece.joint
        if motor in _joints(self.document):
            raise ClieError(f"{self.source} has a joint {motor!r} already, which an elastic gear "
                            f"at {name} would need; rename it, or give the model as it was before "
                            "the first export")
        behind = joint.torque * piece.gear_value("motor_damping")
        bearing = max(joint.damping - behind, 0.0)
        self.document.set(element, {"armature": inertia, "damping": bearing, "frictionloss": None,
                                    "solreffriction": None, "solimpfriction": None})
        attributes: dict[str, Any] = {
            "name": motor, "type": element.attributes.get("type", "hinge"),
            **{key: element.attributes[key] for key in ("axis", "class", "ref")
               if key in element.attributes},
            "limited": "false", "stiffness": 0.0, "armature": piece.inertia_at_motor, **found,
            "damping": behind}
        body = element.parent
        assert body is not None  # a joint stands in a body
        self.document.insert_before(body, _tag("body", _pose(body) | {"name": motor}, [
            _tag("inertial", {"pos": "0 0 0", "mass": TINY,
                              "diaginertia": f"{TINY} {TINY} {TINY}"}),
            _tag("joint", attributes)]))
        compliance = piece.gear_value("compliance")
        self.tail.append(_tag("tendon", {}, [_tag(
            "fixed", {"name": f"{name}_gear", "stiffness": joint.torque / compliance,
                      "damping": joint.torque * piece.gear_value("damping"),
                      "springlength": "0"},
            [_tag("joint", {"joint": motor, "coef": "1"}),
             _tag("joint", {"joint": name, "coef": "-1"})])]))
        return motor

    def _payload(self, setting: Any) -> None:
        """A mass at the end of the last corrected link, once."""
        body = _joints(self.document)[self.names[self.correction.names[-1]]].parent
        if body is None or any(one.attributes.get("name") == "payload"
                               for one in body.every("body")):
            return
        n = len(self.correction.joints)
        vectors = setting.vectors(n)
        mass, length = float(vectors["mass"][0]), float(vectors["length"][-1])
        if f"payload {mass:.9g}" in self.tail:
            return
        self.notes.append(f"The payload of {mass:.6g} kg sits {length:.6g} m along x of the last "
                          "body; move it where your last link ends.")
        text = _tag("body", {"name": "payload", "pos": f"{length:.9g} 0 0"}, [
            _tag("inertial", {"pos": "0 0 0", "mass": mass,
                              "diaginertia": f"{TINY} {TINY} {TINY}"})])
        if not any(note.startswith("The payload") for note in self.notes[:-1]):
            self.document.append(body, text)

    def _actuator(self, piece: Split, name: str, motor: str) -> Driven:
        """Edit the actuator of a joint, and say how it is driven."""
        joint = piece.joint
        found = [one for section in self.document.root.children if section.name == "actuator"
                 for one in section.children if one.attributes.get("joint") == name]
        corrects = piece.offset or _changes_drive(piece)
        if not found:
            if corrects:
                self.notes.append(f"No actuator drives {name}; one was added, whose control is "
                                  f"the logged command [{joint.unit_u}].")
                self.tail.append(_tag("actuator", {}, [_tag("general", {
                    "name": f"{name}_drive", "joint": motor, "gear": joint.gear,
                    "gainprm": piece.gain, **_bias(piece, joint.gear),
                    **piece.actuator_attributes(1.0, self.step)})]))
                return Driven(motor, name, f"{name}_drive", 1.0)
            return Driven(motor, name, "", 1.0)
        if len(found) > 1 or found[0].name not in TORQUE_ACTUATORS:
            return self._other_actuator(piece, name, motor, found, bool(corrects))
        return self._torque_actuator(piece, name, motor, found[0])

    def _other_actuator(self, piece: Split, name: str, motor: str, found: Sequence[Element],
                        corrects: bool) -> Driven:
        """Leave an actuator that takes no torque, and refuse where it would have to change."""
        kinds = ", ".join(f"<{one.name}>" for one in found)
        if _changes_drive(piece) or piece.gear or piece.apart:
            reason = ("its words mean something else before and after MuJoCo 3.12"
                      if any(one.name == "dcmotor" for one in found)
                      else "its control is a set-point, and the correction is of the torque")
            raise ClieError(
                f"{self.source}: {name} is driven by {kinds}, and {reason}. Drive it by a "
                "<motor> whose control is the command of your controller, then export again")
        if corrects:
            self.notes.append(f"{name} is driven by {kinds}: its constant torque of "
                              f"{piece.offset:.6g} {piece.joint.unit_torque} is added by "
                              "corrected_joints.py.")
        return Driven(motor, name, "", 1.0, piece.offset)

    def _torque_actuator(self, piece: Split, name: str, motor: str, element: Element) -> Driven:
        """Edit gear, gain, bias, limit and times of an actuator whose control is a command."""
        joint = piece.joint
        label = element.attributes.get("name", "")
        place = self._place(element)
        gear = float(self.compiled.actuator_gear[place, 0])
        gain = float(self.compiled.actuator_gainprm[place, 0])
        nominal = _before(joint, "gear") * _before(joint, "gain")
        control = nominal / (gear * gain)
        if abs(control - 1.0) < SAME:
            control = 1.0
        else:
            self.notes.append(f"The control of {label or name} is {control:.6g} times the logged "
                              f"command [{joint.unit_u}], by its gear and gain in the model.")
        if not label:
            label = f"{name}_drive"
            self.document.set(element, {"name": label})
        wanted = joint.gear * piece.gain / (control if control != 1.0 else 1.0)
        attributes: dict[str, float | str] = {}
        if control == 1.0 and element.name == "general":
            if abs(joint.gear / gear - 1.0) > 1e-9:
                attributes["gear"] = joint.gear
            if abs(piece.gain / gain - 1.0) > 1e-9:
                attributes["gainprm"] = piece.gain
            gear = joint.gear
        elif abs(wanted / (gear * gain) - 1.0) > 1e-9:
            attributes["gear"] = gear = wanted / gain
        bias = _bias(piece, gear)
        if bias and np.any(self.compiled.actuator_biasprm[place, 1:3]):
            raise ClieError(f"{self.source}: the bias of the actuator {label} depends on position "
                            "or velocity, which is a control law within the model, and the logs "
                            "hold the command of another one; leave that to your controller, "
                            "then export again")
        if bias and element.name == "motor":
            self.document.rename(element, "general")
        attributes |= {**bias, **piece.actuator_attributes(control, self.step)}
        if motor != name:
            attributes["joint"] = motor
        self.document.set(element, attributes)
        return Driven(motor, name, label, control)

    def _place(self, element: Element) -> int:
        """Number of an actuator: they are numbered in the order of the file."""
        every = [one for section in self.document.root.children if section.name == "actuator"
                 for one in section.children]
        name = element.attributes.get("name")
        return int(self.compiled.actuator(name).id) if name else every.index(element)

    def _is_radian(self, joint: Joint) -> bool:
        compiler = next((one for one in self.document.root.children if one.name == "compiler"),
                        None)
        return joint.slides or (compiler is not None and
                                compiler.attributes.get("angle") == "radian")


def _joints(document: XmlText) -> dict[str, Element]:
    """Joints of the bodies by name."""
    return {one.attributes["name"]: one for section in document.root.children
            if section.name == "worldbody" for one in section.every("joint")
            if "name" in one.attributes}


def _whole(document: XmlText, source: str) -> str:
    """The file in words, with what it includes, which is not searched."""
    included = [one.attributes.get("file", "") for one in document.root.every("include")]
    return source if not included else (
        f"{source} (without {', '.join(included)}, which it includes: give that file as the "
        "model, or write all into one with mujoco.MjSpec.from_file(...).to_xml())")


def _mass(compiled: mujoco.MjModel) -> np.ndarray:
    """Mass matrix in the pose that the model begins in."""
    import mujoco

    data, full = mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_forward(compiled, data)
    for k in range(compiled.nv):  # column by column: this call has one form in every version
        mujoco.mj_mulM(compiled, data, full[k], np.eye(compiled.nv)[k])
    return full


def _before(joint: Joint, name: str) -> float:
    value = joint.before.get(name)
    return float(getattr(joint, name)) if value is None else float(value)


def _changes_drive(piece: Split) -> bool:
    """Whether anything between command and torque is corrected."""
    joint = piece.joint
    nominal = _before(joint, "gear") * _before(joint, "gain")
    return bool(abs(joint.gear * piece.gain / nominal - 1.0) > 1e-9
                or any(one.effect.port == "drive" for one in (*piece.native, *piece.block)))


def _bias(piece: Split, gear: float) -> dict[str, str]:
    if not piece.offset:
        return {}
    return {"biastype": "affine", "biasprm": f"{piece.offset / gear:.9g} 0 0"}


def _pose(body: Element) -> dict[str, str]:
    return {key: body.attributes[key] for key in ("pos", "quat", "euler", "axisangle", "xyaxes",
                                                  "zaxis") if key in body.attributes}


def _notes(correction: Correction) -> Iterator[str]:
    for row in correction.without_block:
        yield f"Left out: {row['effect']} at {', '.join(row['joints'])}: {row['why']}."
    for setting in correction.of_law:
        yield f"Your controller or your log needs it, not the model: {setting!r}."


def _tag(name: str, attributes: Mapping[str, Any], inside: Sequence[str] = ()) -> str:
    shown = "".join(f" {key}={quoteattr(value if isinstance(value, str) else f'{value:.9g}')}"
                    for key, value in attributes.items())
    if not inside:
        return f"<{name}{shown}/>"
    lines = "\n".join(f"  {line}" for part in inside for line in part.splitlines())
    return f"<{name}{shown}>\n{lines}\n</{name}>"
