"""Thresholds of residuals and fits."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class FittingMethod:
    """Thresholds of residuals and fits."""
