"""A block function that no trace can show: the program calls it back where it stands."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from clie_blocks.errors import ClieError


class Callback:
    """A block function of one flat vector: t, states, inputs, parameters.

    Parameters
    ----------
    name : str
        The block and which of its functions, for messages.
    function : callable
        ``(t, x, u, params)``.
    nx, nu, size : int
        Number of states and inputs, and of values that it returns.
    shapes : dict
        Shape of every parameter that is part of the vector.
    constants : dict
        The other parameters.

    Attributes
    ----------
    width : int
        Length of the vector.

    """

    def __init__(self, name: str, function: Callable[..., Any], nx: int, nu: int, size: int,
                 shapes: Mapping[str, tuple[int, ...]], constants: Mapping[str, Any]) -> None:
        self.name, self.function, self.size = name, function, size
        ends = np.cumsum([1, nx, nu, *(int(np.prod(shape)) for shape in shapes.values())]).tolist()
        self.width, self._constants = ends[-1], constants
        self._x, self._u, *values = map(slice, ends, ends[1:])
        self._params = [(key, part, shape) for (key, shape), part in zip(shapes.items(), values)]

    def __call__(self, operands: np.ndarray) -> np.ndarray:
        """Return the values of the function."""
        x, u = operands[self._x], operands[self._u]
        params = {**self._constants, **{key: operands[part].reshape(shape)[()]
                                    for key, part, shape in self._params}}
        try:
            result = np.asarray(self.function(float(operands[0]), x, u, params), float).reshape(-1)
        except Exception as error:
            raise ClieError(f"{self.name}: it failed when called back with x = {x}, u = {u}: "
                            f"{type(error).__name__}: {error}") from error
        if result.size != self.size:
            raise ClieError(f"{self.name}: it returned {result.size} values where {self.size} are "
                            "declared")
        return result
