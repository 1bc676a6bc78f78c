"""Thresholds of the explanation in a softened loop, where backlash may be at work."""

import dataclasses

from clie_blocks.analysis.gap.method.threshold import threshold


@dataclasses.dataclass(frozen=True)
class BacklashMethod:
    """Thresholds of the explanation in a softened loop, where backlash may be at work."""

    stiffness_share: float = threshold(
        0.3, "share of kp", "feedback that holds a model near the measured motion")
    damping_share: float = threshold(
        0.1, "share of kd", "the same of the rate, which carries most of the noise")
    negligible_share: float = threshold(
        0.03, "share of the whole excess",
        "a right model may leave this much: impacts stay a little uncertain")
    right_share: float = threshold(
        1e-4, "share of the whole excess",
        "a right model leaves as much of a large gap: where less is left, nothing is sought")
    largest_share_alone: float = threshold(
        0.8, "share of the whole excess",
        "backlash alone must leave less for the whole library to be searched")
    start_gaps: tuple[float, ...] = threshold(
        (0.8, 0.9, 1.0, 1.1, 1.25), "times the fitted gap",
        "starts of further fits: each impact that comes or goes is a ridge in the misfit")
    start_contacts: tuple[float, ...] = threshold(
        (250.0, 400.0, 600.0, 1000.0), "rad/s", "stiffness of a closed gap in these starts")
    restarts: int = threshold(3, "fits", "the best of the starts that are fitted")
