"""Functions from outside that a program calls: machine code by its address, known by its content.

A program holds the number of a function, which its content gives, so that equal programs are equal
in every process.  The function itself is loaded by whoever builds the block that calls it.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence

import numpy as np

from clie_blocks.errors import ClieError

_DIGITS = 12  # of a digest: so many are exact in a float
_NAME = re.compile(r"@foreign_(\d+)\(")


class ForeignFunction:
    """``f(operands) -> results``, without a memory of its own.

    Parameters
    ----------
    digest : str
        Hexadecimal, of its content.
    library : ctypes.CDLL
        That holds it.
    symbol : str
        Its name there: ``void symbol(const double *operands, double *results)``.
    operands, results : int
        How many numbers it takes and gives.

    """

    def __init__(self, digest: str, library: ctypes.CDLL, symbol: str, operands: int,
                 results: int) -> None:
        self.number, self.operands, self.results = int(digest[:_DIGITS], 16), operands, results
        self._function = library[symbol]
        self._function.restype = None
        self.address = ctypes.cast(self._function, ctypes.c_void_p).value or 0
        _loaded[self.number] = self

    def __call__(self, operands: Sequence[float] | np.ndarray) -> np.ndarray:
        """Results of operands, shape (results,)."""
        given, results = np.array(operands, float), np.empty(self.results)
        self._function(ctypes.c_void_p(given.ctypes.data), ctypes.c_void_p(results.ctypes.data))
        return results


_loaded: dict[int, ForeignFunction] = {}


def foreign_function(number: float) -> ForeignFunction:
    """Return the loaded function of a number.

    Raises
    ------
    ClieError
        If this process has not loaded it.

    """
    function = _loaded.get(int(number))
    if function is None:
        raise ClieError("the program calls a function in C that this process has not loaded; "
                        "build its block here first, with law_in_c")
    return function


def foreign_name(number: float) -> str:
    """Return the name of a function in LLVM text."""
    return f"foreign_{int(number)}"


def foreign_addresses(text: str) -> dict[str, int]:
    """Address by name of all such functions that an LLVM text calls."""
    return {foreign_name(float(number)): foreign_function(float(number)).address
            for number in set(_NAME.findall(text))}
