"""The links of the corrected model as bodies, for an export that has no model of the user's."""

from __future__ import annotations

from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import corrected_links, zero_change
from clie_blocks.analysis.gap.causes.load import corrected_gravity
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.report.joint_side import turn
from clie_blocks.robot_loop.links import Links

IN_BODIES = ("gravity", "base_tilt", "payload")  # causes that bodies and gravity hold
FULL = [0, 3, 5, 1, 2, 4]  # xx, yy, zz, xy, xz, yz of the inertia of `Links`


def arm(result: Result) -> dict[str, Any] | None:
    """Return the corrected links; None where none are stated.

    Each body is in the frame of its joint, which turns about its z axis, or slides along it.
    Masses, payload, gravity and zeros are those that were identified.
    """
    hypothesis = result.model.hypothesis
    problem, values = hypothesis.problem, hypothesis.values
    if not problem.links.known:
        return None
    links = corrected_links(problem.links, values)
    zeros, = links.at_joints(turn(problem) - zero_change(values, problem.n))
    inertia = links.inertia[:, FULL].astype(float)
    if links.is_planar:  # stated about the axes only, and a body needs all three
        inertia[:, :3] = links.spin_inertia[:, None]
    payload = values.get("payload.mass")
    return {
        "gravity": _gravity(links, hypothesis),
        "payload": 0.0 if payload is None else float(payload.flat[0]),
        "tip": links.along[-1], "motor_coupling": links.motor_coupling,
        "bodies": [{"parent": links.parents[k] + 1, "rotation": links.rotation[k],
                    "offset": links.offset[k], "mass": links.mass[k], "com": links.com[k],
                    "inertia": inertia[k], "reads_zero_at": zeros[k]} for k in range(links.n)]}


def _gravity(links: Links, hypothesis: Hypothesis) -> np.ndarray:
    """Gravity of the corrected model in the frame of the base (3,) [m/s^2]."""
    values = hypothesis.values
    if not links.is_planar:
        return corrected_gravity(links, values)
    along, across, tilt = (float(values[key].flat[0]) if key in values else 0.0
                           for key in ("gravity.along", "gravity.across", "base_tilt.tilt"))
    down = np.array([across + links.has_gravity * np.sin(tilt),
                     along + links.has_gravity * np.cos(tilt), 0.0])
    return -links.g * down
