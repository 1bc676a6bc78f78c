"""Expressions as numbers, operation by operation: there at once, for a few points."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.operations import operation_named
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
