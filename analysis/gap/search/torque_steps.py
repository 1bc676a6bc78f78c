"""Torque in steps: the resolution of a drive at which the rounded commands explain most."""

from collections.abc import Iterator

import numpy as np

from clie_blocks.analysis.gap.search.drive_errors import DriveErrors, Use, drop_of
from clie_blocks.measurement import quantized

_CANDIDATES = 6  # steps that are looked at closely
_SKIPPED = 4  # of so many samples one tells which fine steps are worth a closer look
_FINEST, _FINE, _COARSEST = 0.005, 0.02, 0.2  # steps, over the largest command
_SHIFT = 0.15  # of a step, by which the largest command shifts from one step tried to the next
_COARSE_SHIFT = 0.3  # the same of commands of RMS size
_WIDEST = 0.05  # of a step, from one coarse step tried to the next


def no_step(logs: int) -> Use:
    """Return a resolution that rounds nothing."""
    return Use(0.0, {"resolution": 0.0})


def best_step(joint: DriveErrors) -> Use:
    """Return the resolution at which the rounding of the commands explains most of the error."""
    largest = max(np.abs(u).max() for u in joint.u)
    if not largest:
        return no_step(len(joint.u))
    best = max((_step(joint, step) for step in (*_coarse_steps(joint, largest),
                                                *_likely_fine_steps(joint, largest))), key=drop_of)
    if best.drop <= joint.least:
        return best
    for share in (1.0, 0.3, 0.1, 0.03, 0.01):
        step = float(best.values["resolution"])
        shifts = share * _SHIFT * step * step / largest * np.arange(-8, 9)
        best = max([best, *(_step(joint, step + shift) for shift in shifts)], key=drop_of)
    return best


def _coarse_steps(joint: DriveErrors, largest: float) -> Iterator[float]:
    """Steps that round most commands to a few levels, close enough that one is near the right one.

    What rounding to so few levels adds is much like the command itself, so that its product with
    the error grows with the step.
    """
    size = float(np.sqrt(np.mean(np.concatenate([joint.u[j] for j in joint.fitted]) ** 2)))
    step = _COARSEST * largest
    while step > _FINE * largest:
        yield step
        step -= step * min(_WIDEST, _COARSE_SHIFT * step / size)


def _likely_fine_steps(joint: DriveErrors, largest: float) -> list[float]:
    """Finer steps whose rounding has the largest product with the error sent back."""
    tried, step = list[float](), _FINE * largest
    while step > _FINEST * largest:
        tried.append(step)
        step -= _SHIFT * step * step / largest
    gains = [_rounding_gain(joint, step) / step for step in tried]
    return [tried[i] for i in np.argsort(gains)[::-1][:_CANDIDATES]]


def _rounding_gain(joint: DriveErrors, step: float) -> float:
    few = slice(None, None, _SKIPPED)
    return float(sum(joint.back[j][few] @ (quantized(joint.u[j][few], step) - joint.u[j][few])
                     for j in joint.fitted))


def _step(joint: DriveErrors, step: float) -> Use:
    return Use(joint.drop([quantized(joint.u[j], step) - joint.u[j] for j in joint.fitted]),
               {"resolution": step})
