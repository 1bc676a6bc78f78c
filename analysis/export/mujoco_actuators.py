"""Actuators of the user's MJCF: gain, bias, limit and times of those that take a torque."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.export.correction import before
from clie_blocks.analysis.export.mjcf_elements import actuators_of, tag
from clie_blocks.analysis.export.mujoco_split import Split
from clie_blocks.analysis.export.xml_text import Element, XmlText
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    import mujoco

SAME = 0.01  # relative: a control of the user's actuator is then the logged command
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


@dataclasses.dataclass(frozen=True, eq=False)
class Actuators:
    """The actuators of one model, and what their edits leave to say and to write.

    Parameters
    ----------
    document : XmlText
        The MJCF.
    compiled : mujoco.MjModel
        The same model, compiled.
    source : str
        What to call it in a message.
    step : float
        Its time step [s].
    notes, tail : list of str
        Notes for the user, and sections to be added behind all others.
    moves : str
        What they drive: a ``joint``, or the ``tendon`` that is the motor of several joints.

    """

    document: XmlText
    compiled: mujoco.MjModel
    source: str
    step: float
    notes: list[str]
    tail: list[str]
    moves: str = "joint"

    def bring_in(self, piece: Split, name: str, motor: str) -> Driven:
        """Edit the actuator of a joint, and say how it is driven."""
        joint = piece.joint
        found = [one for one in actuators_of(self.document)
                 if one.attributes.get(self.moves) == name]
        corrects = piece.offset or _changes_drive(piece)
        if not found:
            if corrects:
                self.notes.append(f"No actuator drives {name}; one was added, whose control is "
                                  f"the logged command [{joint.unit_u}].")
                self.tail.append(tag("actuator", {}, [tag("general", {
                    "name": f"{name}_drive", self.moves: motor, "gear": joint.gear,
                    "gainprm": piece.gain, **_bias(piece, joint.gear),
                    **self._times_and_limit(piece, name, 1.0)})]))
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
        nominal = before(joint, "gear") * before(joint, "gain")
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
        own = self.compiled.actuator_biasprm[place]
        bias = _bias(piece, gear, bool(own[0]))
        if bias and np.any(own[1:3]):
            raise ClieError(f"{self.source}: the bias of the actuator {label} depends on position "
                            "or velocity, which is a control law within the model, and the logs "
                            "hold the command of another one; leave that to your controller, "
                            "then export again")
        attributes |= {**bias, **self._times_and_limit(piece, name, control)}
        if element.name == "motor" and ("biastype" in attributes or "dyntype" in attributes):
            self.document.rename(element, "general")
        if motor != name:
            attributes["joint"] = motor
        self.document.set(element, attributes)
        return Driven(motor, name, label, control)

    def _times_and_limit(self, piece: Split, name: str, control: float,
                         ) -> dict[str, float | str]:
        """Limit, lag and delay of an actuator; says where the model steps too far for them."""
        import mujoco

        delay = piece.values.get("time_delay.delay", 0.0)
        if 0.0 < delay < self.step * (1 - 1e-9):
            self.notes.append(f"The delay of {delay:.6g} s at {name} is shorter than the model's "
                              f"time step of {self.step:g} s, and comes later than that: set "
                              "option timestep to the delay or less, and export again.")
        return piece.actuator_attributes(control, self.step, of_fourth_order=bool(
            self.compiled.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4))

    def _place(self, element: Element) -> int:
        """Number of an actuator: they are numbered in the order of the file."""
        name = element.attributes.get("name")
        return int(self.compiled.actuator(name).id) if name else (
            actuators_of(self.document).index(element))


def _changes_drive(piece: Split) -> bool:
    """Whether anything between command and torque is corrected."""
    joint = piece.joint
    nominal = before(joint, "gear") * before(joint, "gain")
    return bool(abs(joint.gear * piece.gain / nominal - 1.0) > 1e-9
                or any(one.effect.port == "drive" for one in (*piece.native, *piece.block)))


def _bias(piece: Split, gear: float, is_stated: bool = False) -> dict[str, str]:
    """Constant torque of an actuator with a gear, as attributes."""
    if not (piece.offset or is_stated):
        return {}
    return {"biastype": "affine", "biasprm": f"{piece.offset / gear:.9g} 0 0"}
