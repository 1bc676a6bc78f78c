"""Port labels and checked parameters per joint, without python-control.

What only runs a compiled program starts without python-control, which takes a third of a second.
"""

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError

PerJoint = float | np.ndarray  # a parameter: one value for all joints, or an array of shape (n,)


class DiagramError(ClieError, ValueError):
    """A block or a wire of a diagram is not what the diagram needs."""


def signals(*names: str, n: int) -> list[str]:
    """Labels of vector signals, in python-control's form ``'q[0]'``.

    Parameters
    ----------
    *names : str
        Base names, such as ``'q', 'dq'``.
    n : int
        Length of each vector.

    Returns
    -------
    list of str
        ``['q[0]', 'q[1]', 'dq[0]', 'dq[1]']`` for ``signals('q', 'dq', n=2)``.

    """
    return [f"{name}[{k}]" for name in names for k in range(n)]


def vector(value: ArrayLike, name: str, *, n: int | None = None, unit: str = "",
           above: float | None = None, least: float | None = None) -> np.ndarray:
    """One value per joint as a float array, checked.

    Parameters
    ----------
    value : array_like, shape () or (n,)
        A scalar stands for all joints.
    name : str
        What the message calls it, such as ``'pd: kp'``.
    n : int, optional
        Number of joints; without it the length of `value` decides.
    unit : str
        Unit, for the message.
    above, least : float, optional
        Every entry must be greater than `above`, and at least `least`.

    Returns
    -------
    ndarray, shape (n,)
        A fresh array.

    Raises
    ------
    DiagramError
        If the value is not numeric, not finite, of the wrong length or out of bounds.

    """
    try:
        array = np.array(value, float, ndmin=1)
    except (TypeError, ValueError):
        raise DiagramError(f"{name} must be a number per joint [{unit}], got {value!r}") from None
    if n is not None and array.size == 1:
        array = np.full(n, array.item())
    if array.ndim != 1 or (n is not None and array.size != n):
        wanted = "one number per joint" if n is None else f"{n} numbers, one per joint"
        raise DiagramError(f"{name} needs {wanted}, got shape {np.shape(value)}")
    rules = [(np.isfinite(array), "finite")]
    if above is not None:
        rules.append((array > above, f"greater than {above:g}"))
    if least is not None:
        rules.append((array >= least, f"at least {least:g}"))
    for holds, rule in rules:
        if not np.all(holds):
            raise DiagramError(f"{name} must be {rule}{f' [{unit}]' if unit else ''}, got {array}")
    return array


def ports(labels: Iterable[str]) -> dict[str, list[int]]:
    """Group labels by base name: ``{'q': [0, 1], 'dq': [2, 3]}``."""
    groups: dict[str, list[int]] = {}
    for position, label in enumerate(labels):
        groups.setdefault(re.sub(r"\[\d+\]$", "", label), []).append(position)
    return groups
