"""A threshold of the method: a field with its default, its unit, and the reason for its value."""

import dataclasses
from typing import Any


def threshold(default: Any, unit: str, reason: str) -> Any:
    """Return a dataclass field that carries its unit and the reason for its value."""
    return dataclasses.field(default=default, metadata={"unit": unit, "reason": reason})
