"""The program as machine code."""

import ctypes
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from clie_blocks.compiled.codegen.hoisting import Hoisted
from clie_blocks.compiled.codegen.lane_layout import SINGLE, Memory
from clie_blocks.compiled.codegen.llvm import function
from clie_blocks.compiled.codegen.machine import Machine
from clie_blocks.compiled.codegen.methods import Method
from clie_blocks.compiled.codegen.stepper import run_function
from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.foreign import foreign_addresses
from clie_blocks.compiled.ir.layout import Layout

_REAL, _COUNT, _ARRAY = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p
_CALLED_BACK = ctypes.CFUNCTYPE(None, _COUNT, _ARRAY, _ARRAY)


def module(layout: Layout, method: Method, memory: Memory = SINGLE) -> str:
    """Return the LLVM text of a program: derivative, observe and the loop over steps.

    The derivative stays out of line: inlined into every stage it was 2 % quicker on the paper's
    loop and took twice as long to compile.
    """
    derivative, first = function("derivative", layout.derivatives, "x", "noinline", memory)
    observe, second = function("observe", layout.record, "record", "noinline", memory)
    watch, third = function("watch", [*layout.derivatives, *layout.watch], "x", "noinline",
                            memory) if layout.watch else ("", set())
    loop = run_function(method, *_sizes(layout, memory), memory.width, bool(layout.watch))
    return "\n".join([*sorted(first | second | third), derivative, observe, watch, loop])


def module_of_runs(apart: Hoisted, method: Method, memory: Memory, parameters: int) -> str:
    """Return the LLVM text of a program that is only run: constants are computed once a run.

    Its derivative and observe find them behind the parameters, where run alone puts them.
    """
    layout, size = apart.layout, memory.size("p", parameters)
    own = apart.varying([memory.varies("p", k) for k in range(parameters)])
    memory = replace(memory, varying=memory.varying | {"c": own})
    functions = [
        function("prepare", apart.constants, "c", "noinline", memory),
        function("derivative", layout.derivatives, "x", "noinline", memory, size),
        function("observe", layout.record, "record", "noinline", memory, size)]
    loop = run_function(method, *_sizes(layout, memory), memory.width,
                        prepared=(size, max(1, memory.size("c", len(own)))))
    declared = set().union(*(declarations for _, declarations in functions))
    return "\n".join([*sorted(declared), *(text for text, _ in functions), loop])


class NativeEngine:
    """The program compiled for this processor.

    Parameters
    ----------
    layout : Layout
        What to compute.
    method : Method
        The Butcher table.
    memory : Memory
        What differs between lanes; by default there is one lane.
    text : str, optional
        The LLVM text, if it was written before, see `module` and `module_of_runs`.
    is_brief : bool
        It is only run, for about as long as its optimisation would take.

    """

    def __init__(self, layout: Layout, method: Method, memory: Memory = SINGLE,
                 text: str | None = None, is_brief: bool = False) -> None:
        self._board = Switchboard(layout.opaque)
        code = text or module(layout, method, memory)
        called_back = {"opaque": self._board.address} if layout.opaque else {}
        at_points = [] if is_brief else ["derivative", "observe"]
        self._machine = Machine(code, [*at_points, "run"],
                                called_back | foreign_addresses(code), is_brief)
        self.cached, self._sizes = self._machine.cached, _sizes(layout, memory)
        self._at_points = {name: self._machine.function(name, _REAL, *[_ARRAY] * 4)
                           for name in at_points}
        self._run = self._machine.function(
            "run", _COUNT, _REAL, _REAL, _COUNT, *[_ARRAY] * 3, _COUNT, _COUNT, *[_ARRAY] * 2,
            result=_COUNT)

    def derivative(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the derivatives of the states."""
        return self._at_point(self._at_points["derivative"], self._sizes[0], t, x, u, p)

    def observe(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the record."""
        return self._at_point(self._at_points["observe"], self._sizes[2], t, x, u, p)

    def run(self, n: int, h: float, t0: float, first: int, x: np.ndarray, inputs: np.ndarray,
            p: np.ndarray, every: int, slots: np.ndarray, log: np.ndarray) -> int:
        """Take n steps in place and return how many; fills rows of `log` every so many steps."""
        taken = self._run(n, h, t0, first, x.ctypes.data, inputs.ctypes.data, p.ctypes.data,
                          every, len(slots), slots.ctypes.data, log.ctypes.data)
        self._board.raise_failure()
        return taken

    def _at_point(self, function: Callable[..., Any], size: int, t: float, x: np.ndarray,
                  u: np.ndarray, p: np.ndarray) -> np.ndarray:
        x, u, p = (np.ascontiguousarray(value, dtype=float) for value in (x, u, p))
        result = np.zeros(size)
        function(t, x.ctypes.data, u.ctypes.data, p.ctypes.data, result.ctypes.data)
        self._board.raise_failure()
        return result


def _sizes(layout: Layout, memory: Memory) -> tuple[int, int, int]:
    return (memory.size("x", layout.nx), layout.nu, memory.size("record", len(layout.record)))


class Switchboard:
    """The one C function through which machine code reaches the callbacks of a program.

    Parameters
    ----------
    callbacks : list of Callback
        By index.

    """

    def __init__(self, callbacks: list[Callback]) -> None:
        self._callbacks = callbacks
        self._failures: list[BaseException] = []
        self._entry = _CALLED_BACK(self._answer)

    @property
    def address(self) -> int:
        """Where machine code calls."""
        return ctypes.cast(self._entry, ctypes.c_void_p).value or 0

    def _answer(self, index: int, operands: int, results: int) -> None:
        callback = self._callbacks[index]
        values = _numbers_at(results, callback.size)
        try:
            values[:] = np.nan if self._failures else callback(
                _numbers_at(operands, callback.width).copy())
        except BaseException as error:  # nothing may escape into machine code
            self._failures.append(error)
            values[:] = np.nan

    def raise_failure(self) -> None:
        """Raise what went wrong since the last time, if anything did."""
        if self._failures:
            first = self._failures[0]
            self._failures.clear()
            raise first


def _numbers_at(address: int, size: int) -> np.ndarray:
    return np.frombuffer(memoryview((ctypes.c_double * size).from_address(address)))
