"""What of a corrected joint MuJoCo holds by its own elements, and what a block must add."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from clie_blocks.analysis.export.correction import Correction, Joint
from clie_blocks.analysis.export.joint_block import why_no_block
from clie_blocks.effects.effect import Setting
from clie_blocks.robot_loop.pieces import pieces_of

FRICTION = ("coulomb", "asymmetric_coulomb")
LOADS = ("quadratic_drag", "spring")
DRIVE = ("actuator_saturation", "torque_gain_error", "actuator_lag", "time_delay")
EXTRA_BODY = ("joint_elasticity",)
IN_BODIES = ("payload",)
# First version of MuJoCo with the words.
NEEDS = {"time_delay": (3, 5), "quadratic_drag": (3, 7), "spring": (3, 7)}
FRICTION_STEPS = 2  # of the simulator, in which dry friction is held: the fewest it takes


@dataclasses.dataclass(frozen=True)
class Split:
    """How the effects of one joint are brought into MuJoCo.

    Parameters
    ----------
    joint : Joint
        The joint.
    native : tuple of Setting
        Effects that are attributes of joint and actuator.
    gear : Setting or None
        An elastic gear as a second hinge, on which the motor sits.
    block : tuple of Setting
        Effects of the block that runs beside the model.
    bodies : tuple of Setting
        Effects that are bodies of their own.
    left : tuple of (Setting, str)
        Effects that no one holds, with the reason.
    values : dict
        Parameters of the native effects at this joint, by ``effect.parameter``.

    """

    joint: Joint
    native: tuple[Setting, ...]
    gear: Setting | None
    block: tuple[Setting, ...]
    bodies: tuple[Setting, ...]
    left: tuple[tuple[Setting, str], ...]
    values: dict[str, float]

    @property
    def apart(self) -> Setting | None:
        """A gear whose motor moves inside the block."""
        return next((one for one in self.block if one.effect.port == "transmission"
                     and hasattr(one.effect.build, "active")), None)

    @property
    def friction_in_block(self) -> bool:
        """Whether the block writes the dry friction of the joint at every step."""
        return any(map(is_dry_friction, self.block))

    def joint_attributes(self, step: float) -> dict[str, float | str]:
        """Attributes of the joint that feels friction and drive, but for its inertia."""
        joint, value = self.joint, self.values
        drag, cubic = (joint.torque * value.get(f"quadratic_drag.{name}", 0.0)
                       for name in ("drag", "cubic"))
        found: dict[str, float | str] = {
            "damping": _polynomial(0.0 if self.apart else joint.damping, drag, cubic)}
        forward, backward = self._dry()
        loss = joint.torque * (forward + backward) / 2
        if loss or (self.friction_in_block and not self.apart):
            found |= {"frictionloss": loss, "solreffriction": f"{FRICTION_STEPS * step:.9g} 1",
                      "solimpfriction": "0.9999 0.9999 0.001"}
        return found

    def _dry(self) -> tuple[float, float]:
        level = self.values.get("coulomb.level", 0.0)
        return (level + self.values.get("asymmetric_coulomb.forward", 0.0),
                level + self.values.get("asymmetric_coulomb.backward", 0.0))

    @property
    def stiffness(self) -> str:
        """Of a spring at the joint, as a polynomial; empty without one."""
        stiffness = self.joint.torque * self.values.get("spring.stiffness", 0.0)
        hardening = stiffness * self.values.get("spring.hardening", 0.0)
        return _polynomial(stiffness, 0.0, hardening) if stiffness else ""

    @property
    def spring_rest(self) -> float:
        """Position without torque of that spring [rad or m]."""
        return self.joint.zero + self.values.get("spring.rest", 0.0)

    @property
    def offset(self) -> float:
        """Constant torque of the actuator; what dry friction differs by is one."""
        if self.apart:
            return 0.0
        forward, backward = self._dry()
        return self.joint.offset - self.joint.torque * (forward - backward) / 2

    @property
    def gain(self) -> float:
        """Torque of the motor per unit of the logged command."""
        return self.joint.gain * (1.0 + self.values.get("torque_gain_error.error", 0.0))

    @property
    def inertia_at_motor(self) -> float:
        """Inertia that leaves the joint with its motor [kg m^2 or kg]."""
        gear = self.gear or self.apart
        return 0.0 if gear is None else self.joint.torque * self._of(gear, "motor_inertia")

    def gear_value(self, name: str) -> float:
        """Parameter of the elastic gear, in the units of the model."""
        return 0.0 if self.gear is None else self._of(self.gear, name)

    def _of(self, setting: Setting, name: str) -> float:
        return self.values[f"{setting.effect.name}.{name}"]

    def actuator_attributes(self, unit: float, step: float, *, of_fourth_order: bool,
                            ) -> dict[str, float | str]:
        """Limit, lag and delay of the actuator.

        Runge-Kutta integrates a lag by itself, and takes steps of an exact filter that are too
        short.  All methods feel a command half a step before it acts on average.

        Parameters
        ----------
        unit : float
            Control per logged command.
        step : float
            Time step of the model [s].
        of_fourth_order : bool
            It is integrated by the method of Runge and Kutta.

        """
        value = self.values
        found: dict[str, float | str] = {}
        if "actuator_saturation.limit" in value:
            limit = unit * value["actuator_saturation.limit"] / self.joint.command
            found |= {"ctrllimited": "true", "ctrlrange": f"{-limit:.9g} {limit:.9g}"}
        if value.get("actuator_lag.lag"):
            found |= {"dyntype": "filter" if of_fourth_order else "filterexact",
                      "dynprm": value["actuator_lag.lag"]}
        if delay := value.get("time_delay.delay"):
            middle = delay + step / 2
            found |= {"delay": middle, "interp": "linear",
                      "nsample": str(math.ceil(middle / step - 1e-9) + 2)}
        return found


def _polynomial(*coefficients: float) -> str:
    """Coefficients of an attribute that takes a polynomial, without zeros at the end."""
    last = max((k for k, value in enumerate(coefficients) if value), default=0)
    return " ".join(f"{value:.9g}" for value in coefficients[:last + 1])


def split(correction: Correction, k: int, *, damps_springs: bool = False) -> Split:
    """Return how joint k is brought into MuJoCo.

    A group (dry friction; what acts between command and torque) is native as a whole or not at
    all: within it the order counts.  A gear whose law MuJoCo lacks takes everything at the motor
    into the block.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    k : int
        The joint, from 0.
    damps_springs : bool
        The model is integrated by a method that damps the stiff spring of an elastic gear, which
        then goes into the block.

    """
    n = len(correction.joints)
    native: list[Setting] = []
    block: list[Setting] = []
    bodies: list[Setting] = []
    left: list[tuple[Setting, str]] = []
    gear: Setting | None = None
    found = correction.at(k)
    for one in found:
        why = why_no_block(one, 1)  # the module sees all joints
        if one is correction.belt:
            native.append(one)
        elif one.effect.name in IN_BODIES:
            bodies.append(one)
        elif why:
            left.append((one, why))
        elif one.effect.name in EXTRA_BODY and not (damps_springs or correction.tendons):
            gear = one
        else:
            block.append(one)
    apart = any(one.effect.port == "transmission" and hasattr(one.effect.build, "active")
                for one in block)
    if not apart:
        for group in (_native_friction(block), _native_loads(block), _native_drive(block)):
            native += group
        block = [one for one in block if one not in native]
    shown = [*native, *([gear] if gear else []), *(one for one in block if apart)]
    values = {f"{one.effect.name}.{key}": float(value[k if len(value) == n else 0])
              for one in shown for key, value in one.vectors(n).items()}
    return Split(correction.joints[k], tuple(native), gear, tuple(block), tuple(bodies),
                 tuple(left), values)


def is_dry_friction(setting: Setting) -> bool:
    """Whether an effect is a largest torque against motion."""
    return any(piece.port == "friction" for piece in pieces_of(
        setting.effect, [p.name for p in setting.effect.parameters]))


def _native_friction(block: list[Setting]) -> list[Setting]:
    dry = [one for one in block if is_dry_friction(one)]
    names = [one.effect.name for one in dry]
    return dry if set(names) <= set(FRICTION) and len(set(names)) == len(names) else []


def _native_loads(block: list[Setting]) -> list[Setting]:
    names = [one.effect.name for one in block]
    return [one for one in block if one.effect.name in LOADS and names.count(
        one.effect.name) == 1]


def _native_drive(block: list[Setting]) -> list[Setting]:
    """The chain of the drive, if MuJoCo has it in the same order: limit, then delay or lag."""
    drive = [one for one in block if one.effect.port == "drive"]
    names = [one.effect.name for one in drive]
    late = [name for name in names if name in ("actuator_lag", "time_delay")]
    in_order = "actuator_saturation" not in names or all(
        name != "torque_gain_error" and name not in late
        for name in names[:names.index("actuator_saturation")])
    known = set(names) <= set(DRIVE) and len(set(names)) == len(names) and len(late) <= 1
    reads_torque = any("u" in getattr(one.effect.build, "inputs", ()) for one in block
                       if one.effect.port != "drive")
    return drive if known and in_order and not reads_torque else []


def armature(piece: Split, of_bodies: float | None) -> float:
    """Armature of the joint: the inertia beside links, less what bodies and a motor bring.

    Parameters
    ----------
    piece : Split
        The joint.
    of_bodies : float or None
        Inertia that the bodies of the user's model bring [kg m^2 or kg]; None where they are the
        stated links.

    """
    inertia = piece.joint.beside_links if of_bodies is None else (
        piece.joint.inertia - of_bodies)
    return float(np.float64(inertia - piece.inertia_at_motor))
