"""A whole diagram as one function, of arrays or of the symbols of another program.

What is traced once can stand inside a larger block: the closed loop that a diagnosis simulates
holds the user's controller, or the whole of the user's loop, in this form.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.compiled.frontend.symbol_arrays import array_of
from clie_blocks.compiled.frontend.tracing import trace
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.ir.scalars import F
from clie_blocks.compiled.ir.symbols import Expression, Symbol, TraceError, topological

if TYPE_CHECKING:
    from control import InputOutputSystem


CALLED_BACK = re.compile(r"[;,] or have it called back, slowly: opaque=\[.*?\]")


@dataclasses.dataclass(frozen=True, eq=False)
class StepFunction:
    """``f(t, x, u, p) -> (rate or next state, outputs)`` of a diagram.

    Parameters
    ----------
    roots : tuple of Expression
        Rates or next states, then outputs.
    states : int
        Number of the former.
    parameters : Parameters
        Parameters of the diagram: keys, slots, and the values with which it was built.

    """

    roots: tuple[Expression, ...]
    states: int
    parameters: Parameters

    @functools.cached_property
    def order(self) -> list[Symbol]:
        """Nodes below the roots, operands before the operations that use them."""
        return topological(self.roots)

    def __call__(self, t: float | np.ndarray, x: np.ndarray, u: np.ndarray,
                 p: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Rates or next state, and outputs, with parameters as built unless they are given."""
        variables: dict[str, Any] = {
            "t": [t], "x": x, "u": u, "p": self.parameters.defaults if p is None else p}
        values: dict[Symbol, Any] = {}
        for node in self.order:
            values[node] = _evaluate(node, variables, values)
        results = array_of([values[root] if isinstance(root, Symbol) else root
                            for root in self.roots])
        return results[:self.states], results[self.states:]

    @property
    def digest(self) -> str:
        """What tells its equations from all others, the same in every process."""
        place = {node: f"#{k}" for k, node in enumerate(self.order)}

        def shown(argument: Any) -> str:
            return place[argument] if isinstance(argument, Symbol) else repr(argument)

        lines = [" ".join([node.op, *map(shown, node.args)]) for node in self.order]
        lines += [" ".join(map(shown, self.roots)), f"{self.states}"]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def step_function(diagram: InputOutputSystem) -> StepFunction:
    """Return a diagram as a function.

    Raises
    ------
    TraceError
        If a block of it cannot be traced; names the block and the remedy, which is not a callback.
    DiagramError
        For an algebraic loop.

    """
    try:
        traced = trace(diagram)
    except TraceError as error:
        raise type(error)(CALLED_BACK.sub("", str(error))) from error
    if traced.opaque:
        raise TraceError(f"{traced.opaque[0].name}: it is opaque and cannot be traced, and "
                         "what stands within another program must become part of it; write it "
                         "with numpy functions of (t, x, u, params) that work element by element, "
                         "np.where instead of a branch on a signal")
    outputs = [traced.signals[label] for label in traced.outputs]
    return StepFunction((*traced.derivatives, *outputs), len(traced.derivatives),
                        traced.parameters)


def _evaluate(node: Symbol, variables: Mapping[str, Any], values: Mapping[Symbol, Any]) -> Any:
    if node.op == "variable":
        kind, index = node.args
        return variables[kind][index]
    return getattr(F, node.op)(*(values.get(argument, argument)
                                 if isinstance(argument, Symbol) else argument
                                 for argument in node.args))

