"""Do the methods agree?  Where they do not, the model's structure is the first suspect."""

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from clie_blocks.analysis.identification.regression import Estimate

REFERENCE = "closed-loop LS"
RELATIVE = 0.01  # differences below are of filters and finite steps, not of structure


@dataclasses.dataclass(frozen=True)
class Disagreement:
    """Two methods that differ beyond their intervals on one term of one joint."""

    joint: str
    term: str
    method: str
    reference: str
    value: float
    expected: float
    margin: float

    def __str__(self) -> str:
        return (f"{self.joint}: {self.method} gives {self.term} = {self.value:.4g}, "
                f"{self.reference} gives {self.expected:.4g}; they differ by "
                f"{abs(self.value - self.expected):.2g} where {self.margin:.2g} is expected")


def disagreements(joint: str, estimates: Sequence[Estimate],
                  scale: float = 1.0) -> list[Disagreement]:
    """Terms of a joint on which a method differs from the closed-loop least squares.

    Empty when all agree or there is nothing to compare with; a method without an interval is not
    compared.  `scale` goes from units of the command to those that are shown.
    """
    reference = next((e for e in estimates if e.method == REFERENCE), None)
    if reference is None:
        return []
    return [difference for other in estimates if other is not reference for term in other.names
            for difference in _differ(joint, term, other, reference, scale)]


def agreement(by_joint: Iterable[Sequence[Estimate]]) -> str:
    """Say how well the methods agree that do not disagree; estimates are by joint, by method."""
    apart = [_apart(other, reference, term) for estimates in by_joint
             for reference in estimates if reference.method == REFERENCE
             for other in estimates if other is not reference for term in other.names]
    ratios = [ratio for ratio in apart if np.isfinite(ratio)]
    if not ratios:
        return ("Whether the methods agree cannot be told: no two of them have a value with an "
                "interval.")
    if max(ratios) <= 1.0:
        return "The methods agree within their intervals."
    return f"The methods agree within {RELATIVE:.0%}, though not within their intervals."


def _apart(other: Estimate, reference: Estimate, term: str) -> float:
    """Difference of two methods over what their intervals allow; NaN without an interval."""
    (value, width), (expected, own) = other.get(term), reference.get(term)
    allowed = np.hypot(width, own)
    return float(abs(value - expected) / allowed) if allowed > 0.0 else np.nan


def _differ(joint: str, term: str, other: Estimate, reference: Estimate,
            scale: float) -> list[Disagreement]:
    (value, width), (expected, own) = other.get(term), reference.get(term)
    if not np.isfinite(width):
        return []
    size = max(abs(reference.value[1]), abs(expected)) if term == "offset" else abs(expected)
    margin = np.hypot(width, own) + RELATIVE * size
    if abs(value - expected) <= margin:
        return []
    return [Disagreement(joint, term, other.method, reference.method, scale * value,
                         scale * expected, float(scale * margin))]
