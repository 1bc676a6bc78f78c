"""Block functions that are called back: their nodes in a program, and what they cost."""

import dis
import time
import types
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.compiled.frontend.symbol_arrays import flat_scalars
from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.symbols import Expression, Graph

CALLS = 20


class OpaqueBlockWarning(UserWarning):
    """Part of a compiled program runs in Python."""


def reads_inputs(function: Callable[..., Any]) -> bool:
    """Return whether a block function ``(t, x, u, params)`` may read u, by its byte code."""
    if not isinstance(function, types.FunctionType) or function.__code__.co_argcount < 3:
        return True
    name = function.__code__.co_varnames[2]
    return any(instruction.argval == name or (isinstance(instruction.argval, tuple)
                                              and name in instruction.argval)
               for instruction in dis.get_instructions(function))


def call_nodes(graph: Graph, callbacks: list[Callback], callback: Callback,
               operands: list[Expression]) -> list[Expression]:
    """Add a callback to a program and return its values as symbols."""
    index = float(len(callbacks))
    callbacks.append(callback)
    call = graph.make("call", (index, float(callback.size), *flat_scalars(operands)))
    return [graph.make("pick", (call, float(k))) for k in range(callback.size)]


def warn_of_callbacks(owner: str, callbacks: list[Callback]) -> None:
    """Warn of what the opaque blocks of a program cost, if it has any."""
    if not callbacks:
        return
    times = [1e6 * _seconds(callback) for callback in callbacks]
    parts = [f"{callback.name} ({time:.0f} us)" for callback, time in zip(callbacks, times)]
    warnings.warn(
        f"{owner}: the program calls back {' and '.join(parts)} at every evaluation: about "
        f"{6 * sum(times):.0f} us per step of ode5, where a traced block takes less than 1 us",
        OpaqueBlockWarning, stacklevel=3)


def _seconds(callback: Callback) -> float:
    """Median time of a call [s], at operands that a block is likely to accept."""
    operands, times = np.full(callback.width, 0.5), []
    for _ in range(CALLS):
        begun = time.perf_counter()
        try:
            callback(operands)
        except Exception:  # the block may refuse such operands
            break
        times.append(time.perf_counter() - begun)
    return np.median(times) if times else np.nan
