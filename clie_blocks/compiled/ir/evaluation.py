"""Expressions as numbers, operation by operation: there at once, for a few points."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import operation_named
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.ir.symbols import Expression, Symbol, topological


def evaluate(roots: Sequence[Expression], variables: Mapping[str, Any],
             opaque: Sequence[Callback] = ()) -> np.ndarray:
    """Return the values of some expressions.

    Parameters
    ----------
    roots : list
        Expressions.
    variables : dict
        Values by kind: ``{'t': [t], 'x': x, 'u': u, 'p': p}``.
    opaque : list of Callback
        Functions that are called back.

    """
    values: dict[Symbol, Any] = {}
    with np.errstate(all="ignore"):
        for node in topological(roots):
            if node.op == "variable":
                kind, index = node.args
                values[node] = np.float64(variables[kind][index])
                continue
            operands = [values[a] if isinstance(a, Symbol) else a for a in node.args]
            values[node] = (opaque[int(operands[0])](np.array(operands[2:])) if node.op == "call"
                            else operation_named(node.op).numpy(*operands))
    return np.array([values[a] if isinstance(a, Symbol) else a for a in roots], float)


@dataclass
class Interpreted:
    """A program that is there at once, for a few points: its expressions, evaluated one by one.

    Parameters
    ----------
    name, states, outputs, params
        As of the `Program`.
    layout : Layout
        What to evaluate.
    parameters : Parameters
        Where the values of parameters lie.

    """

    name: str
    states: list[tuple[str, str]]
    outputs: list[str]
    params: dict[str, Any]
    layout: Layout
    parameters: Parameters

    def dynamics(self, t: float, x: ArrayLike, u: ArrayLike,
                 params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Derivatives of the states, as ``diagram.dynamics``."""
        return self._values(self.layout.derivatives, t, x, u, params)

    def output(self, t: float, x: ArrayLike, u: ArrayLike,
               params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Outputs, as ``diagram.output``."""
        return self._values([self.layout.record[self.layout.slots[name]] for name in self.outputs],
                            t, x, u, params)

    def _values(self, roots: Sequence[Expression], t: float, x: ArrayLike, u: ArrayLike,
                params: Mapping[str, ArrayLike] | None) -> np.ndarray:
        numbers = {"t": [t], "x": np.ravel(x), "u": np.ravel(u),
                   "p": self.parameters.vector(params, self.name)}
        return evaluate(roots, numbers, self.layout.opaque)
