"""A cause that the command path shows by itself, and a parameter of it as the answer has it."""

import dataclasses
from typing import Any

import numpy as np

Entry = dict[str, Any]
"""A parameter in the answer: ``value``, ``unit`` and ``interval``, an entry per joint."""


@dataclasses.dataclass(frozen=True, eq=False)
class SignalFinding:
    """A cause that lies on the command path.

    Parameters
    ----------
    effect : str
        Name in the vocabulary.
    joints : tuple of int
        Where it was found.
    probability : float
        Of the cause.
    parameters : dict
        Parameter -> ``value``, ``unit`` and ``interval``, an entry per joint.
    share : float
        Of the gap, where that is known.
    left : dict
        What each explanation leaves of each joint's motion [rad]: arrays by name of
        `position_path.EXPLAINED_BY`.
    alike : tuple of str
        Other names that explain these logs as well.

    """

    effect: str
    joints: tuple[int, ...]
    probability: float
    parameters: dict[str, Entry]
    share: float = 0.0
    left: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    alike: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Row of the JSON answer."""
        return {"effect": self.effect, "joint": [k + 1 for k in self.joints],
                "probability": self.probability, "alike": list(self.alike),
                "parameters": self.parameters}


def entry(value: np.ndarray, unit: str, low: np.ndarray | None = None,
          high: np.ndarray | None = None) -> Entry:
    """Entry of a parameter, with its interval where that is known."""
    return {"value": value, "unit": unit, "interval": None if low is None else [low, high]}
