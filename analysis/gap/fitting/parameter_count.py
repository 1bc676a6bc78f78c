"""Parameters that the causes of a hypothesis spend, as far as the logs determine them."""

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member

_ONSET = "onset"  # no fit moves it, but it was chosen among hundreds of moments


def parameter_count(fit: Fit) -> float:
    """Parameters that a hypothesis spends beyond the joint model, at the joint that takes most.

    A parameter that the logs do not determine costs nothing: it excludes no course of the motion.
    What differs between the logs is spent in each of them.
    """
    hypothesis = fit.hypothesis
    onsets = hypothesis.problem.fit_runs * sum(
        number.name == _ONSET for member in hypothesis.members
        for number in member.cause.numbers)
    return onsets + sum(_determined_at_worst_joint(fit, member) for member in hypothesis.members)


def _determined_at_worst_joint(fit: Fit, member: Member) -> float:
    """Directions of a cause's parameters that the logs determine, at the joint with most."""
    counted = {f"{member.name}.{number.name}" for number in member.cause.numbers
               if not number.nuisance}
    by_joint: dict[int | None, list[int]] = {}
    for i, parameter in enumerate(fit.hypothesis.free_parameters):
        if parameter.key in counted:
            by_joint.setdefault(parameter.joint, []).append(i)
    return max((_determined(fit, indices) for indices in by_joint.values()), default=0.0)


def _determined(fit: Fit, indices: list[int]) -> float:
    """Number of directions of some free parameters that are known better than their size."""
    hypothesis = fit.hypothesis
    size = np.array([max(parameter.size, abs(hypothesis.get(parameter)))
                     for parameter in (hypothesis.free_parameters[i] for i in indices)])
    relative = fit.covariance[np.ix_(indices, indices)] / np.outer(size, size)
    spread = np.linalg.eigvalsh(relative)
    return float(np.sum(1.0 / (1.0 + np.maximum(spread, 0.0))))
