"""The target ``mujoco``: an MJCF with the correction in it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clie_blocks.analysis.export.correction import (
    Correction,
    check_basis,
    check_joint_names,
    check_kind,
)
from clie_blocks.analysis.export.mjcf_elements import (
    TINY,
    in_words,
    is_radian,
    joints_of,
    point_mass,
    pose_of,
    tag,
    tendons_of,
)
from clie_blocks.analysis.export.mujoco_actuators import Actuators, Driven
from clie_blocks.analysis.export.mujoco_engine import (
    damps_springs,
    free_inertia,
    joint_type,
    load,
    mass_matrix,
    weighs,
)
from clie_blocks.analysis.export.mujoco_split import NEEDS, Split, armature, split
from clie_blocks.analysis.export.mujoco_stub import fixed_tendon
from clie_blocks.analysis.export.xml_text import Element, XmlText
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    import mujoco

LARGEST_SHARE = 0.5  # of what the bodies bring about a joint, that a negative armature takes off


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
        If the model lacks a joint, has one that moves otherwise, drives one by a set-point
        although the drive is corrected, or the installed MuJoCo lacks a word that the correction
        needs.
    RecordError
        If the text is no MJCF.
    MissingExtraError
        If MuJoCo is not installed.

    """
    check_basis(correction, source)
    document = XmlText(text, source)
    if document.root.name != "mujoco":
        raise ClieError(f"{source} begins with <{document.root.name}>, and an MJCF with <mujoco>; "
                        + ("it is an SDF, which --to gazebo patches"
                           if document.root.name == "sdf" else
                           "give the MJCF of the robot (MuJoCo converts a URDF)"))
    names = {name: (renamed or {}).get(name, name) for name in correction.names}
    check_joint_names(tuple(names.values()), tuple(joints_of(document)),
                      in_words(document, source))
    if correction.tendons is not None:
        _check_motors(correction, document, names, source)
    compiled = load(text, source, folder)
    for joint in correction.joints:
        kind = joint_type(compiled, names[joint.name])
        check_kind(joint, names[joint.name], kind, [joint.kind], source)
    patch = _Patch(correction, document, compiled, names, source)
    patched = patch.apply()
    load(patched.text, f"the corrected {source}", folder)
    return patched


def _check_motors(correction: Correction, document: XmlText, names: Mapping[str, str],
                  source: str) -> None:
    """Refuse a model that lacks the motor, as a tendon, of joints that several motors turn."""
    known = tendons_of(document)
    missing = [fixed_tendon(names[name], zip(names.values(), shares))
               for name, shares in zip(correction.names, correction.tendons or ())
               if names[name] not in known]
    if missing:
        raise ClieError(
            f"{source}: motors of this robot turn several joints ("
            f"{'motor_coupling' if correction.belt is None else correction.belt!r}), and the "
            "model lacks them. Add to its <tendon>\n" + "\n".join(missing) + "\nand drive each by "
            "an actuator with its name as tendon=; or leave out --model for a model that has them")


class _Patch:
    """The edits of one model."""

    def __init__(self, correction: Correction, document: XmlText, compiled: mujoco.MjModel,
                 names: Mapping[str, str], source: str) -> None:
        self.correction, self.document, self.compiled = correction, document, compiled
        self.names, self.source = names, source
        self.step = float(compiled.opt.timestep)
        self.notes: list[str] = list(correction.common_notes)
        self.tail: list[str] = []  # sections behind all others
        self.actuators = Actuators(document, compiled, source, self.step, self.notes, self.tail,
                                   "joint" if correction.tendons is None else "tendon")
        self.added: list[Setting] = []  # masses that are in the model by now
        self.elements = (joints_of if correction.tendons is None else tendons_of)(document)

    def apply(self) -> CorrectedModel:
        """Edit every joint, and return the model."""
        self._leave_weight_to_bodies()
        damps = damps_springs(self.compiled)
        splits = tuple(split(self.correction, k, damps_springs=damps)
                       for k in range(len(self.correction.joints)))
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

    def _leave_weight_to_bodies(self) -> None:
        """Take out the weight that the robot file left out and the model has."""
        held = [one for one in self.correction.effects if one.effect.name == "gravity"]
        if held and weighs(self.compiled):
            self.correction = dataclasses.replace(self.correction, effects=tuple(
                one for one in self.correction.effects if one not in held))
            self.notes.append(
                f"{held[0]!r} is left to the bodies of the model, which weigh already, by its "
                'option gravity; give a model with gravity="0 0 0" for the weight that the logs '
                "show.")

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
        element = self.elements[name]
        dof = int(self.compiled.joint(name).dofadr[0])
        found = piece.joint_attributes(self.step)
        inertia = self._armature(piece, element, dof)
        if piece.stiffness:
            in_degrees = not (piece.joint.slides or is_radian(self.document))
            rest = math.degrees(piece.spring_rest) if in_degrees else piece.spring_rest
            self.document.set(element, {"stiffness": piece.stiffness,
                                        "springref" if element.name == "joint"
                                        else "springlength": rest})
        for setting in piece.bodies:
            self._payload(setting)
        motor = name
        if piece.gear is None:
            self.document.set(element, {"armature": inertia, **found})
        else:
            motor = self._elastic(piece, element, name, inertia, found)
        for setting, why in piece.left:
            self.notes.append(f"Left out at {name}: {setting!r}; {why}.")
        return self.actuators.bring_in(piece, name, motor)

    def _armature(self, piece: Split, element: Element, dof: int) -> float:
        of_bodies = None
        if not piece.joint.links_known:
            whole = mass_matrix(self.compiled)[dof, dof]
            of_bodies = float(whole - self.compiled.dof_armature[dof])
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
        least = -LARGEST_SHARE * free_inertia(self.compiled, dof)
        self.notes.append(
            f"The bodies of the model bring {-inertia:.6g} {unit} more about "
            f"{piece.joint.name} than the logs show ({piece.joint.inertia:.6g} {unit}); its "
            f"armature is {'negative' if inertia >= least else 0} now, and the masses of the "
            "bodies need a look.")
        return inertia if inertia >= least else 0.0

    def _elastic(self, piece: Split, element: Element, name: str, inertia: float,
                 found: Mapping[str, float | str]) -> str:
        """Put the motor on a joint of its own, and the spring of the gear between the two."""
        motor, joint = f"{name}_motor", piece.joint
        if motor in joints_of(self.document):
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
        self.document.insert_before(body, tag("body", pose_of(body) | {"name": motor}, [
            point_mass(TINY), tag("joint", attributes)]))
        compliance = piece.gear_value("compliance")
        self.tail.append(tag("tendon", {}, [tag(
            "fixed", {"name": f"{name}_gear", "stiffness": joint.torque / compliance,
                      "damping": joint.torque * piece.gear_value("damping"),
                      "springlength": "0"},
            [tag("joint", {"joint": motor, "coef": "1"}),
             tag("joint", {"joint": name, "coef": "-1"})])]))
        return motor

    def _payload(self, setting: Setting) -> None:
        """A mass at the end of the last corrected link: each joint feels it, one body holds it."""
        if setting in self.added:
            return
        self.added.append(setting)
        body = joints_of(self.document)[self.names[self.correction.names[-1]]].parent
        assert body is not None  # a joint stands in a body
        vectors = setting.vectors(len(self.correction.joints))
        mass, length = float(vectors["mass"][0]), float(vectors["length"][-1])
        self.document.append(body, tag("body", {
            "name": setting.name, "pos": f"{length:.9g} 0 0"}, [point_mass(mass)]))
        self.notes.append(f"The payload of {mass:.6g} kg sits {length:.6g} m along x of the last "
                          "body; move it where your last link ends.")
