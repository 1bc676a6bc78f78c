"""A function from outside as part of a block: of numbers, and of the symbols of a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from clie_blocks.compiled.frontend.symbol_arrays import array_of, flat_scalars
from clie_blocks.compiled.ir.foreign import ForeignFunction
from clie_blocks.compiled.ir.scalars import F


class ForeignCall:
    """Call of a foreign function.

    Parameters
    ----------
    function : ForeignFunction
        The function.

    """

    def __init__(self, function: ForeignFunction) -> None:
        self.function = function

    def __call__(self, *operands: Any) -> np.ndarray:
        """Results of numbers, arrays or symbols, one after the other."""
        size = self.function.results
        values = F.foreign(float(self.function.number), float(size), *flat_scalars(operands))
        return array_of([F.pick(values, float(k)) for k in range(size)])
