"""Thresholds of the assessment: gap reduction, torque map, next experiment."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class AssessmentMethod:
    """Thresholds of the assessment: gap reduction, torque map, next experiment."""
