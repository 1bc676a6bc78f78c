"""Which target holds which effect, and how: read from what the exports do with the effect."""

from __future__ import annotations

import dataclasses
from functools import cache

from clie_blocks.analysis.export.correction import Correction, Joint
from clie_blocks.analysis.export.joint_block import why_no_block
from clie_blocks.analysis.export.mujoco_split import NEEDS, split
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.insertion import of_law

NATIVE, EXTRA_BODY, MODULE, ONE_JOINT, BODIES, CONTROLLER, NOT = (
    "native", "extra bodies", "plugin", "plugin, one joint", "your bodies", "controller",
    "impossible")
MEANING = {
    NATIVE: "elements of MuJoCo's own which move as the effect does; of code, the function of the "
            "joint",
    EXTRA_BODY: "a body of its own beside the joint's, with native elements between them",
    MODULE: "a block that runs beside the model, step by step",
    ONE_JOINT: "such a block, for a robot of one joint; it would have to see the other joints",
    BODIES: "a mass: it belongs into the bodies of the simulator that calls the block",
    CONTROLLER: "an effect of the control law or of the recorder: it belongs there",
    NOT: "neither words nor a block",
}
TARGETS = ("mujoco", "code")  # code: c, fmu and every other target around the C or Python core
IN_THE_MODEL = ("inertia", "viscous", "offset", "torque_gain", "coupling")
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
    block = MODULE if entry.per_joint else ONE_JOINT
    if target != "mujoco":
        if entry.port == "body":
            return Support(effect, target, BODIES)
        if why_no_block(setting, 1):
            return Support(effect, target, NOT)
        return Support(effect, target, NATIVE if entry.per_joint else ONE_JOINT)
    if effect in IN_THE_MODEL:
        return Support(effect, target, NATIVE)
    found = split(Correction((_SAMPLE,), 1e-3, (setting,)), 0)
    if found.native:
        since = FIRST.get(effect, "") if effect in NEEDS else ""
        return Support(effect, target, NATIVE, since)
    if found.gear or found.bodies:
        return Support(effect, target, EXTRA_BODY)
    return Support(effect, target, block if found.block else NOT)


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
