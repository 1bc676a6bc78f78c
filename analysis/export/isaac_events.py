"""Corrections that were drawn, as an event term of Isaac Lab."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.export.core import core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.robot_loop.pieces import Late


def isaac_events(correction: Correction, drawn: Sequence[Correction], step: float,
                 ) -> tuple[str, tuple[str, ...]]:
    """Return the source of an event term that draws corrections, and what its user must know.

    Parameters
    ----------
    correction : Correction
        The identified one, of which the actuator was made.
    drawn : sequence of Correction
        The draws.
    step : float
        Step of the blocks [s].

    """
    joints, notes = [], []
    for k in range(len(correction.joints)):
        made = core(joint_block(correction, k, step))
        longest = _longest_delays(correction, k, step)
        rows = [[_within(value, longest.get(key)) for key in made.program.params
                 for value in np.ravel(joint_block(one, k, step).system().params[key])]
                for one in drawn]
        inertias = [core(joint_block(one, k, step)).inertia - made.inertia for one in drawn]
        least = max(0.0, -min(inertias))
        joints.append((made.quoted, rows, inertias, least))
        if least:
            joint = correction.joints[k]
            unit = "kg" if joint.slides else "kg m^2"
            notes.append(
                f"Draws of {joint.name} have up to {least:.6g} {unit} less inertia than the "
                "identified one. Isaac Lab takes no negative armature: where that of your model "
                "is smaller, the joint keeps the rest, and the event warns.")
    return fill("isaac_events.py.j2", joints=joints, count=len(drawn)), tuple(notes)


def _longest_delays(correction: Correction, k: int, step: float) -> dict[str, float]:
    """Longest delay that the line of the identified block holds [s], by parameter."""
    return {f"{name}.{piece.act.longest}": piece.states * step
            for name, piece in joint_block(correction, k, step).pieces
            if isinstance(piece.act, Late)}


def _within(value: float, most: float | None) -> float:
    return float(value) if most is None else min(float(value), most)
