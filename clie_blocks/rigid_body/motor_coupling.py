"""Motors that turn several joints, as in a wrist whose last motor turns the joint before it, too.

With the positions q_m of the motors over their gear ratios, and those q of the joints,

    q = C q_m,    torque_m = C' torque,    M_m = C' M C

by virtual work.  In q_m drives are decoupled: rotors, friction and encoders of the motors belong
to one coordinate each, and the links alone feel C.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body.scalars import Scalar, times, total

Matrix = tuple[tuple[float, ...], ...]

_WORST_CONDITION = 1e6  # of a matrix that can be inverted
_ROUND_OFF = 1e-12


def coupling_of(rows: Any, n: int, where: str = "motor_coupling") -> Matrix | None:
    """Coupling matrix C of n motors, checked; None where each motor turns its own joint only.

    Raises
    ------
    DiagramError
        If it is not n x n, not finite, or cannot be inverted; `where` begins the message.

    """
    matrix = np.array(rows, float)
    if matrix.shape != (n, n):
        raise DiagramError(f"{where} must be {n} rows of {n} numbers, one row per joint and one "
                           f"column per motor, got the shape {' x '.join(map(str, matrix.shape))}")
    if not np.isfinite(matrix).all():
        raise DiagramError(f"{where} must be finite, got {rows!r}")
    if np.linalg.cond(matrix) > _WORST_CONDITION:
        raise DiagramError(f"{where} cannot be inverted: some motion of the joints is that of no "
                           "motor; row k says by how much each motor turns joint k, with 1 for "
                           "its own")
    return None if np.array_equal(matrix, np.eye(n)) else _rows(matrix)


def inverse_of(coupling: Matrix) -> Matrix:
    """Inverse of a coupling matrix, q_m = C^-1 q."""
    inverse = np.linalg.inv(np.array(coupling))
    return _rows(np.where(np.abs(inverse) < _ROUND_OFF * np.abs(inverse).max(), 0.0, inverse))


def mapped(matrix: Matrix, x: np.ndarray) -> np.ndarray:
    """Matrix times positions (..., n): numbers, time series or symbols."""
    return np.stack([total(*(times(c, x[..., k]) for k, c in enumerate(row))) for row in matrix],
                    axis=-1)


def motor_torques(coupling: Matrix, torque: np.ndarray) -> np.ndarray:
    """Torques C' torque that joints (..., n) put on the motors, times their gear ratios."""
    return mapped(tuple(zip(*coupling)), torque)


def motor_mass_rows(coupling: Matrix, rows: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
    """Rows of C' M C from those of a mass matrix M."""
    n = len(rows)
    columns = list(zip(*coupling))
    right = [[total(*(times(columns[k][j], rows[i][j]) for j in range(n))) for k in range(n)]
             for i in range(n)]
    found: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for k in range(i, n):
            found[i][k] = found[k][i] = total(
                *(times(columns[i][j], right[j][k]) for j in range(n)))
    return found


def _rows(matrix: np.ndarray) -> Matrix:
    return tuple(tuple(float(entry) for entry in row) for row in matrix)
