"""Results of fits that are worth keeping, for as long as the model they belong to is in use."""

import weakref
from collections.abc import MutableMapping
from typing import Generic, TypeVar

from clie_blocks.analysis.gap.residual.whitening import ResidualModel

Key = TypeVar("Key")
Value = TypeVar("Value")


class FitCache(Generic[Key, Value]):
    """Values by residual model, then by hypothesis or fit; neither is kept alive by it."""

    def __init__(self) -> None:
        self._by_model: weakref.WeakKeyDictionary[
            ResidualModel, weakref.WeakKeyDictionary[Key, Value]] = weakref.WeakKeyDictionary()

    def of(self, residuals: ResidualModel) -> MutableMapping[Key, Value]:
        """Return the values that belong to one residual model, oldest first."""
        return self._by_model.setdefault(residuals, weakref.WeakKeyDictionary())
