"""Torque in steps: the resolution of a drive at which the rounded commands explain most."""

import numpy as np

from clie_blocks.analysis.gap.search.drive_errors import DriveErrors, Use, drop_of
from clie_blocks.measurement import quantized

_CANDIDATES = 6  # steps that are looked at closely
_SKIPPED = 4  # of so many samples one tells which steps are worth a closer look
_FINEST, _COARSEST = 0.005, 0.2  # steps, over the largest command
_SHIFT = 0.15  # of a step, that the next one tried shifts


def no_step(joint: DriveErrors) -> Use:
    """Return a resolution that rounds nothing."""
    return Use(0.0, {"resolution": 0.0})


def best_step(joint: DriveErrors) -> Use:
    """Return the resolution at which the rounding of the commands explains most of the error."""
    largest = max(np.abs(u).max() for u in joint.u)
    tried, step = [], _COARSEST * largest
    while step > _FINEST * largest:
        tried.append(step)
        step -= _SHIFT * step * step / largest
    gains = np.array([_rounding_gain(joint, step) for step in tried]) if tried else np.zeros(0)
    if not gains.size or not largest:
        return no_step(joint)
    leading = np.argsort(gains / np.array(tried))[::-1][:_CANDIDATES]
    best = max((_step(joint, tried[i]) for i in leading), key=drop_of)
    if best.drop <= joint.least:
        return best
    for share in (0.3, 0.1, 0.03, 0.01):
        step = float(best.values["resolution"])
        shifts = share * _SHIFT * step * step / largest * np.arange(-4, 5)
        best = max([best, *(_step(joint, step + shift) for shift in shifts)], key=drop_of)
    return best


def _rounding_gain(joint: DriveErrors, step: float) -> float:
    few = slice(None, None, _SKIPPED)
    return float(sum(joint.back[j][few] @ (quantized(joint.u[j][few], step) - joint.u[j][few])
                     for j in joint.fitted))


def _step(joint: DriveErrors, step: float) -> Use:
    return Use(joint.drop([quantized(joint.u[j], step) - joint.u[j] for j in joint.fitted]),
               {"resolution": step})
