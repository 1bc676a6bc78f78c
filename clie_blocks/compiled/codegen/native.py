"""The program as machine code."""

import ctypes

import numpy as np

from clie_blocks.compiled.codegen.lane_layout import SINGLE
from clie_blocks.compiled.codegen.llvm import function
from clie_blocks.compiled.codegen.machine import Machine
from clie_blocks.compiled.codegen.stepper import run_function
from clie_blocks.compiled.frontend.callbacks import Switchboard

_REAL, _COUNT, _ARRAY = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p


def module(layout, method, memory=SINGLE):
    """Return the LLVM text of a program: derivative, observe and the loop over steps.

    The derivative stays out of line: inlined into every stage it was 2 % quicker on the paper's
    loop and took twice as long to compile.

    Parameters
    ----------
    layout : Layout
        What to compute.
    method : Method
        The Butcher table.
    memory : Memory
        What differs between lanes.

    """
    derivative, first = function("derivative", layout.derivatives, "x", "noinline", memory)
    observe, second = function("observe", layout.record, "record", "noinline", memory)
    watch, third = function("watch", [*layout.derivatives, *layout.watch], "x", "noinline",
                            memory) if layout.watch else ("", set())
    loop = run_function(method, *_sizes(layout, memory), memory.width, bool(layout.watch))
    return "\n".join([*sorted(first | second | third), derivative, observe, watch, loop])


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
    text : callable
        Gives the LLVM text of the three, as `module` does.

    """

    def __init__(self, layout, method, memory=SINGLE, text=module):
        self._board = Switchboard(layout.opaque)
        self._machine = Machine(text(layout, method, memory), ["derivative", "observe", "run"],
                                {"opaque": self._board.address} if layout.opaque else None)
        self.cached, self._sizes = self._machine.cached, _sizes(layout, memory)
        point = (_REAL, *[_ARRAY] * 4)
        self._derivative = self._machine.function("derivative", *point)
        self._observe = self._machine.function("observe", *point)
        self._run = self._machine.function(
            "run", _COUNT, _REAL, _REAL, _COUNT, *[_ARRAY] * 3, _COUNT, _COUNT, *[_ARRAY] * 2,
            result=_COUNT)

    def derivative(self, t, x, u, p):
        """Return the derivatives of the states."""
        return self._at_point(self._derivative, self._sizes[0], t, x, u, p)

    def observe(self, t, x, u, p):
        """Return the record."""
        return self._at_point(self._observe, self._sizes[2], t, x, u, p)

    def run(self, n, h, t0, first, x, inputs, p, every, slots, log):
        """Take n steps in place and return how many; fills rows of `log` every so many steps."""
        taken = self._run(n, h, t0, first, x.ctypes.data, inputs.ctypes.data, p.ctypes.data,
                          every, len(slots), slots.ctypes.data, log.ctypes.data)
        self._board.raise_failure()
        return taken

    def _at_point(self, function, size, t, x, u, p):
        x, u, p = (np.ascontiguousarray(value, dtype=float) for value in (x, u, p))
        result = np.zeros(size)
        function(t, x.ctypes.data, u.ctypes.data, p.ctypes.data, result.ctypes.data)
        self._board.raise_failure()
        return result


def _sizes(layout, memory):
    return (memory.size("x", layout.nx), layout.nu, memory.size("record", len(layout.record)))
