"""Thresholds of the search: screening, racing, alternatives, backlash."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class SearchMethod:
    """Thresholds of the search: screening, racing, alternatives, backlash."""
