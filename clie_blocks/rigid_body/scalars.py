"""Vectors of three scalars, which may be numbers, time series or symbols of a diagram.

A product with the number 0 is the number 0, and one with 1 is the other factor: what the geometry
of a robot leaves out then costs nothing, neither in numpy nor in a compiled program.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

Scalar = Any
Three = Sequence[Scalar]
Rows = Sequence[Three]

ZERO: Three = (0.0, 0.0, 0.0)
_NEUTRAL = {0.0, 1.0, -1.0}


def times(a: Scalar, b: Scalar) -> Scalar:
    """Product of two scalars."""
    if isinstance(a, float) and a in _NEUTRAL:
        return 0.0 if a == 0.0 else b if a == 1.0 else -b
    if isinstance(b, float) and b in _NEUTRAL:
        return 0.0 if b == 0.0 else a if b == 1.0 else -a
    return a * b


def total(*parts: Scalar) -> Scalar:
    """Sum of some scalars."""
    kept = [part for part in parts if not (isinstance(part, float) and part == 0.0)]
    return sum(kept[1:], kept[0]) if kept else 0.0


def added(*vectors: Three) -> Three:
    """Sum of some vectors."""
    return tuple(total(*parts) for parts in zip(*vectors))


def scaled(k: Scalar, vector: Three) -> Three:
    """Vector times a scalar."""
    return tuple(times(k, part) for part in vector)


def dot(a: Three, b: Three) -> Scalar:
    """Scalar product."""
    return total(*(times(x, y) for x, y in zip(a, b)))


def cross(a: Three, b: Three) -> Three:
    """Vector product."""
    return tuple(total(times(a[i], b[j]), times(-b[i], a[j]))
                 for i, j in ((1, 2), (2, 0), (0, 1)))


def product(matrix: Rows, vector: Three) -> Three:
    """Matrix times vector."""
    return tuple(dot(row, vector) for row in matrix)


def transposed_product(matrix: Rows, vector: Three) -> Three:
    """Transposed matrix times vector."""
    return product(tuple(zip(*matrix)), vector)


def numbers(array: Any) -> Any:
    """Nested tuples of an array, with floats where it holds numbers and symbols elsewhere."""
    if np.ndim(array):
        return tuple(numbers(part) for part in array)
    return float(array) if isinstance(array, int | float) else array
