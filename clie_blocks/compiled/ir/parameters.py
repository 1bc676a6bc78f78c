"""The run-time arguments of a program: where each parameter lies, and new values for them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError


@dataclass
class Parameters:
    """Where each parameter lies in the flat vector that a program reads.

    Parameters
    ----------
    offset, shape : dict
        First slot and shape by key.
    defaults : ndarray
        Values as the diagram was built.
    frozen : set of str
        Keys whose value is part of the program, because a block decides by it.

    """

    offset: dict[str, int] = field(default_factory=dict)
    shape: dict[str, tuple[int, ...]] = field(default_factory=dict)
    defaults: np.ndarray = field(default_factory=lambda: np.zeros(0))
    frozen: set[str] = field(default_factory=set)

    def add(self, key: str, value: ArrayLike) -> None:
        """Give a parameter its slots, unless it has them."""
        if key not in self.offset:
            self.offset[key], self.shape[key] = self.defaults.size, np.shape(value)
            self.defaults = np.append(self.defaults, np.ravel(value).astype(float))

    def key_of(self, slot: int) -> str:
        """Return the key of the parameter that owns a slot."""
        return max((offset, key) for key, offset in self.offset.items() if offset <= slot)[1]

    def vector(self, params: Mapping[str, ArrayLike] | None, owner: str) -> np.ndarray:
        """Return the values of all slots; one number serves all entries of a changed array.

        Raises
        ------
        DiagramError
            For a key that no block has, or that is part of the program, or a wrong shape.

        """
        values = self.defaults.copy()
        for key, value in (params or {}).items():
            slots = self.part(self._known(key, owner), values)
            try:
                slots[...] = np.asarray(value, float)
            except (TypeError, ValueError):
                raise DiagramError(f"{owner}: parameter {key!r} needs shape {slots.shape} or "
                                   f"one number, got {value!r}") from None
        return values

    def part(self, key: str, values: np.ndarray) -> np.ndarray:
        """Return the view of one parameter in the values of all slots."""
        start, shape = self.offset[key], self.shape[key]
        return values[start:start + int(np.prod(shape))].reshape(shape)

    def slots(self, key: str, owner: str) -> slice:
        """Return the slots of one parameter as a slice; refuses unknown keys as `vector`."""
        start = self.offset[self._known(key, owner)]
        return slice(start, start + int(np.prod(self.shape[key])))

    def _known(self, key: str, owner: str) -> str:
        if key in self.frozen:
            raise DiagramError(
                f"{owner}: parameter {key!r} is part of the program, because a block decides by "
                "its value; build the diagram with the new value and compile it")
        own = f"{owner}.{key}"  # of a single block the bare name will do
        if key not in self.offset and own in self.offset:
            return own
        if key not in self.offset:
            raise DiagramError(f"{owner}: no block has the parameter {key!r}; "
                               + nearest(key, [one.removeprefix(f"{owner}.")
                                               for one in self.offset]))
        return key


def is_numeric(value: object) -> bool:
    """Return whether a parameter can be a run-time argument: numbers, not flags or text."""
    if isinstance(value, (bool, str)) or value is None:
        return False
    try:
        array = np.asarray(value)
    except (ValueError, TypeError):
        return False
    return array.dtype.kind in "iuf" and array.size > 0
