"""Which target holds which effect, and how: read from what the exports do with the effect."""

from __future__ import annotations

import dataclasses
from functools import cache

from clie_blocks.analysis.export.correction import Correction, Joint
from clie_blocks.analysis.export.gazebo_target import in_engine
from clie_blocks.analysis.export.joint_block import reads_all_joints, why_no_block
from clie_blocks.analysis.export.mujoco_split import NEEDS, is_dry_friction, split
from clie_blocks.analysis.export.simscape import in_equations
from clie_blocks.analysis.gap.causes.friction import OF_LINKS
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.effect import Setting
from clie_blocks.effects.insertion import of_law

NATIVE, PARTIAL, EXTRA_BODY, MODULE, MOTOR_LOAD, ONE_JOINT, BODIES, CONTROLLER, NOT = (
    "native", "native, partial", "extra bodies", "plugin", "plugin, partial", "plugin, one joint",
    "your bodies", "controller", "impossible")
MEANING = {
    NATIVE: "the simulator's own elements, which move as the effect does; of simscape, equations "
            "of a component; of code, the function of the joint",
    PARTIAL: "equations but for rest: dry friction is smoothed over a speed, and creeps",
    EXTRA_BODY: "a body of its own beside the joint's, with native elements between them",
    MODULE: "a block that runs beside the model, step by step",
    MOTOR_LOAD: "such a block, which takes the torque of the motor for the load of the gear, "
                "since the engine does not tell the weight of the links",
    ONE_JOINT: "such a block, for a robot of one joint; of more joints mujoco holds it, whose "
               "module sees them all",
    BODIES: "masses: the bodies of your own model bring it; nothing is written",
    CONTROLLER: "an effect of the control law or of the recorder: it belongs there",
    NOT: "nothing is written; of simscape, where an effect has memory: simulink holds it",
}
# code: c, fmu and every other target around the C or Python core
TARGETS = ("mujoco", "gazebo", "simscape", "code")
IN_THE_MODEL = ("inertia", "viscous", "offset", "torque_gain")
FIRST = {"spring": "3.7 where it hardens", "quadratic_drag": "3.7", "time_delay": "3.5"}


@dataclasses.dataclass(frozen=True)
class Support:
    """How a target holds an effect.

    Parameters
    ----------
    effect, target : str
        Their names.
    kind : str
        One of the keys of `MEANING`.
    since : str
        First version of the simulator, where it matters.

    """

    effect: str
    target: str
    kind: str
    since: str = ""

    def __str__(self) -> str:
        return f"{self.kind} (from {self.since})" if self.since else self.kind


@cache
def support(effect: str, target: str) -> Support:
    """Return how a target holds an effect of the catalogue, at its typical values.

    Parameters
    ----------
    effect : str
        Name in the catalogue.
    target : str
        One of `TARGETS`.

    """
    entry = LIBRARY[effect]
    setting = entry.typical()
    if entry.port in ("controller", "log") or of_law(setting):
        return Support(effect, target, CONTROLLER)
    alone = Correction((_SAMPLE,), 1e-3, (setting,))
    if target == "mujoco":
        return _in_mujoco(alone, setting)
    if entry.port == "body":
        return Support(effect, target, BODIES)
    if why_no_block(setting, 1):
        return Support(effect, target, NOT)
    if target == "simscape":
        return Support(effect, target, _in_simscape(alone, setting))
    if target == "gazebo" and effect == OF_LINKS.name:
        return Support(effect, target, MOTOR_LOAD)
    plugin = target == "gazebo" and not in_engine(alone, 0)
    return Support(effect, target, ONE_JOINT if reads_all_joints(setting) else
                   MODULE if plugin else NATIVE)


def _in_mujoco(alone: Correction, setting: Setting) -> Support:
    effect = setting.effect.name
    if effect in IN_THE_MODEL:
        return Support(effect, "mujoco", NATIVE)
    found = split(alone, 0)
    if found.native:
        since = FIRST.get(effect, "") if effect in NEEDS else ""
        return Support(effect, "mujoco", NATIVE, since)
    if found.gear or found.bodies:
        return Support(effect, "mujoco", EXTRA_BODY)
    return Support(effect, "mujoco", MODULE if found.block else BODIES)


def _in_simscape(alone: Correction, setting: Setting) -> str:
    if not in_equations(alone, 0, setting):
        return NOT
    if reads_all_joints(setting):
        return ONE_JOINT
    return PARTIAL if is_dry_friction(setting) else NATIVE


def table() -> list[tuple[str, ...]]:
    """Return one row per effect: its name, and how each of `TARGETS` holds it."""
    return [(name, *(str(support(name, target)) for target in TARGETS)) for name in LIBRARY]


def markdown() -> str:
    """Return the table as it stands in docs/export.md."""
    head = ("effect", *TARGETS)
    lines = [head, tuple("---" for _ in head), *table()]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


_SAMPLE = Joint("joint", "hinge", "rad", "N m", 0.0, 1.0, "link", 1.0, 1.0, 1.0, 1.0, 3.0, 3.0,
                False, 0.0, 0.0, {})
