"""Block functions that no trace can show: the program calls them back where they stand."""

import ctypes
import dis
import types

import numpy as np

from clie_blocks.compiled.frontend.symbol_arrays import flat_scalars
from clie_blocks.errors import ClieError

SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)


class Callback:
    """A block function of numbers in a row: t, states, inputs, parameters.

    Parameters
    ----------
    name : str
        The block and which of its functions, for messages.
    function : callable
        ``(t, x, u, params)``.
    nx, nu, size : int
        Number of states and inputs, and of values that it returns.
    shapes : dict
        Shape of every parameter that is among the numbers.
    constants : dict
        The other parameters.

    Attributes
    ----------
    width : int
        How many numbers.

    """

    def __init__(self, name, function, nx, nu, size, shapes, constants):
        self.name, self.function, self.size = name, function, size
        ends = np.cumsum([1, nx, nu, *(int(np.prod(shape)) for shape in shapes.values())]).tolist()
        self.width, self._constants = ends[-1], constants
        self._x, self._u, *values = map(slice, ends, ends[1:])
        self._params = [(key, part, shape) for (key, shape), part in zip(shapes.items(), values)]

    def __call__(self, numbers):
        """Return the values of the function.

        Parameters
        ----------
        numbers : ndarray, shape (width,)
            The operands.

        """
        x, u = numbers[self._x], numbers[self._u]
        params = self._constants | {key: numbers[part].reshape(shape)[()]
                                    for key, part, shape in self._params}
        try:
            result = np.asarray(self.function(float(numbers[0]), x, u, params), float).reshape(-1)
        except Exception as error:
            raise ClieError(f"{self.name}: it failed when called back with x = {x}, u = {u}: "
                            f"{type(error).__name__}: {error}") from error
        if result.size != self.size:
            raise ClieError(f"{self.name}: it returned {result.size} values where {self.size} are "
                            "declared")
        return result


class Switchboard:
    """The one C function through which machine code reaches the callbacks of a program.

    Parameters
    ----------
    callbacks : list of Callback
        By index.

    """

    def __init__(self, callbacks):
        self._callbacks, self._failures = callbacks, []
        self._entry = SIGNATURE(self._answer)

    @property
    def address(self):
        """Where machine code calls."""
        return ctypes.cast(self._entry, ctypes.c_void_p).value

    def _answer(self, index, operands, results):
        callback = self._callbacks[index]
        found = _numbers_at(results, callback.size)
        try:
            found[:] = np.nan if self._failures else callback(
                _numbers_at(operands, callback.width).copy())
        except BaseException as error:  # nothing may escape into machine code
            self._failures.append(error)
            found[:] = np.nan

    def raise_failure(self):
        """Raise what went wrong since the last time, if anything did."""
        if self._failures:
            first = self._failures[0]
            self._failures.clear()
            raise first


def _numbers_at(address, size):
    return np.frombuffer((ctypes.c_double * size).from_address(address))


def reads_inputs(function):
    """Return whether a block function ``(t, x, u, params)`` may read u, by its byte code."""
    if not isinstance(function, types.FunctionType) or function.__code__.co_argcount < 3:
        return True
    name = function.__code__.co_varnames[2]
    return any(instruction.argval == name or (isinstance(instruction.argval, tuple)
                                              and name in instruction.argval)
               for instruction in dis.get_instructions(function))


def call_nodes(graph, callbacks, callback, operands):
    """Add a callback to a program and return its values as symbols.

    Parameters
    ----------
    graph : Graph
        Where the expressions live.
    callbacks : list of Callback
        Those of the program so far; grows by one.
    callback : Callback
        The function.
    operands : list of Symbol or float
        Its numbers.

    """
    index = float(len(callbacks))
    callbacks.append(callback)
    call = graph.make("call", (index, float(callback.size), *flat_scalars(operands)))
    return [graph.make("pick", (call, float(k))) for k in range(callback.size)]
