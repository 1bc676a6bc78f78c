"""Small dense linear algebra on symbols: elimination with rows exchanged by selection."""

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.ir.scalars import F
from clie_blocks.compiled.ir.symbols import Expression, Symbol, TraceError

LARGEST = 12

Rows = list[list[Expression]]


def solve(matrix: ArrayLike, right: ArrayLike) -> np.ndarray:
    """Solution of ``matrix @ x = right``, as ``np.linalg.solve`` for one matrix.

    The largest entry of a column becomes the pivot as in LAPACK; the exchange is a selection, not
    a branch, so it costs a few operations where the entries are signals.
    """
    rows = _rows(matrix, "solve")
    right = np.array(right, dtype=object)
    columns = right.reshape(len(rows), -1)
    _eliminate(rows, sides := [list(row) for row in columns])
    solution = _substitute(rows, sides)
    return np.array(solution, dtype=object).reshape(right.shape)


def inv(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a small matrix."""
    return solve(matrix, np.eye(len(matrix)))


def det(matrix: np.ndarray) -> Expression:
    """Determinant of a small matrix."""
    rows = _rows(matrix, "det")
    result = F.mul(1.0, _eliminate(rows, [[] for _ in rows]))
    for k, row in enumerate(rows):
        result = F.mul(result, row[k])
    return result


def norm(a: np.ndarray, ord: int | str | None = None, axis: int | None = None,
         keepdims: bool = False) -> np.ndarray:
    """Euclidean norm of all entries or along an axis."""
    if ord not in (None, 2, "fro") or (ord == 2 and np.ndim(a) != 1):
        raise TraceError("np.linalg.norm is traced as the Euclidean norm only")
    return np.sqrt(np.sum(np.square(a), axis=axis, keepdims=keepdims))


def _rows(matrix: ArrayLike, name: str) -> Rows:
    array = np.array(matrix, dtype=object)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or len(array) > LARGEST:
        raise TraceError(f"np.linalg.{name} is traced for one square matrix of at most "
                         f"{LARGEST} rows, got shape {array.shape}")
    return [list(row) for row in array]


def _eliminate(rows: Rows, sides: Rows) -> Expression:
    sign = 1.0
    for k in range(len(rows)):
        for i in range(k + 1, len(rows)):
            sign = F.mul(sign, _pivot(rows, sides, k, i))
        for i in range(k + 1, len(rows)):
            factor = F.div(rows[i][k], rows[k][k])
            rows[i] = [F.sub(a, F.mul(factor, b)) for a, b in zip(rows[i], rows[k])]
            sides[i] = [F.sub(a, F.mul(factor, b)) for a, b in zip(sides[i], sides[k])]
    return sign


def _pivot(rows: Rows, sides: Rows, k: int, i: int) -> Expression:
    if not isinstance(rows[i][k], Symbol) and rows[i][k] == 0.0:
        return 1.0
    larger = F.gt(F.abs(rows[i][k]), F.abs(rows[k][k]))
    for table in (rows, sides):
        first = [F.where(larger, b, a) for a, b in zip(table[k], table[i])]
        table[i] = [F.where(larger, a, b) for a, b in zip(table[k], table[i])]
        table[k] = first
    return F.where(larger, -1.0, 1.0)


def _substitute(rows: Rows, sides: Rows) -> Rows:
    for k in reversed(range(len(rows))):
        for i in range(k + 1, len(rows)):
            sides[k] = [F.sub(a, F.mul(rows[k][i], b)) for a, b in zip(sides[k], sides[i])]
        sides[k] = [F.div(a, rows[k][k]) for a in sides[k]]
    return sides
