"""A curve drawn with characters, for a terminal."""

import numpy as np
from numpy.typing import ArrayLike


def text_curve(x: ArrayLike, y: ArrayLike, *, width: int = 57, height: int = 13, x_label: str = "",
               y_label: str = "") -> str:
    """Draw a path on a grid of characters.

    Parameters
    ----------
    x, y : array_like, shape (k,)
        Points of the path.
    width, height : int
        Size of the grid in characters.
    x_label, y_label : str
        Names of the axes with unit.

    Returns
    -------
    str
        The drawing with its limits; the axes through zero where they are inside.

    """
    x, y = (np.asarray(value, float) for value in (x, y))
    columns, rows = _places(x, width), height - 1 - _places(y, height)
    grid = np.full((height, width), " ")
    if np.min(x) < 0 < np.max(x):
        grid[:, _places(np.append(x, 0.0), width)[-1]] = "|"
    if np.min(y) < 0 < np.max(y):
        grid[height - 1 - _places(np.append(y, 0.0), height)[-1], :] = "-"
    for k in range(len(x) - 1):  # fill steep parts, so that jumps stay connected
        steps = 1 + max(abs(rows[k + 1] - rows[k]), abs(columns[k + 1] - columns[k]))
        share = np.linspace(0.0, 1.0, steps + 1)
        grid[np.rint(rows[k] + share * (rows[k + 1] - rows[k])).astype(int),
             np.rint(columns[k] + share * (columns[k + 1] - columns[k])).astype(int)] = "*"
    margin = 10
    left = {0: f"{np.max(y):.3g}", height - 1: f"{np.min(y):.3g}"}
    lines = [f"{'':{margin}} {y_label}"]
    lines += [f"{left.get(k, ''):>{margin}} {''.join(row)}".rstrip() for k, row in enumerate(grid)]
    low, high = f"{np.min(x):.3g}", f"{np.max(x):.3g}"
    middle = x_label.center(width - len(low) - len(high))
    return "\n".join([*lines, f"{'':{margin}} {low}{middle}{high}"])


def _places(values: np.ndarray, size: int) -> np.ndarray:
    """Cells of the values along an axis of the given size."""
    low, span = np.min(values), np.ptp(values)
    if span == 0:
        return np.full(values.shape, size // 2)
    return np.rint((values - low) / span * (size - 1)).astype(int)
