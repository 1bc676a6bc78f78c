"""What runs need not compute at every step.

What depends on parameters alone is computed once for a run.  A quotient by such a value becomes a
product with its reciprocal, and shares it with all others: a division takes as long as ten
products.  The last digit of the quotient may differ.

The sine of an angle that has lost its digits is NaN: the run has diverged, and the exact sines of
such angles take so long that they would hold up the runs beside it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS
from clie_blocks.compiled.ir.scalars import F, number, truth, with_operands
from clie_blocks.compiled.ir.symbols import Expression, Symbol, topological

LOST = 2.0**30  # rad: seven digits of an angle are left


@dataclass(frozen=True)
class Hoisted:
    """Expressions that hold for a whole run, apart from those of a step.

    Parameters
    ----------
    layout : Layout
        What a step computes, of states, inputs, parameters and the variables ``('c', k)``.
    constants : list of Expression
        What each of these variables is, of parameters alone.

    """

    layout: Layout
    constants: list[Expression]

    def varying(self, parameters: Sequence[bool]) -> tuple[bool, ...]:
        """Return which constants differ between lanes, where some parameters do."""
        return tuple(any(parameters[node.args[1]] for node in topological([constant])
                         if node.op == "variable") for constant in self.constants)


def hoisted(layout: Layout) -> Hoisted:
    """Return the expressions of a layout, those that hold for a whole run apart."""
    roots = [*layout.derivatives, *layout.record]
    place = _Places()
    final = _at_each_step(roots, place)
    return Hoisted(replace(layout, derivatives=final[:layout.nx], record=final[layout.nx:]),
                   place.constants)


class _Places:
    """Gives each expression of parameters its variable."""

    def __init__(self) -> None:
        self.constants: list[Expression] = []
        self._known: dict[Symbol, Expression] = {}

    def __call__(self, expression: Expression) -> Expression:
        """Return what stands for it at every step: numbers and parameters are themselves."""
        if not isinstance(expression, Symbol) or expression.op == "variable":
            return expression
        if expression not in self._known:
            variable = expression.graph.variable("c", len(self.constants))
            self.constants.append(number(expression))
            self._known[expression] = truth(variable) if expression.boolean else variable
        return self._known[expression]


def _at_each_step(roots: Iterable[Expression], place: _Places) -> list[Expression]:
    """What a step computes in the place of the roots."""
    of_parameters: set[Symbol] = set()
    final: dict[Symbol, Expression] = {}

    def at_step(a: Expression) -> Expression:
        return final[a] if isinstance(a, Symbol) and a not in of_parameters else place(a)

    for node in topological(roots):
        if _is_of_parameters(node, of_parameters):
            of_parameters.add(node)
            continue
        if node.op == "variable":
            final[node] = node
        elif node.op == "div" and _is_fixed(node.args[1], of_parameters):
            final[node] = F.mul(at_step(node.args[0]), place(F.div(1.0, node.args[1])))
        elif node.op in ("sin", "cos"):
            final[node] = getattr(F, node.op)(_kept(at_step(node.args[0])))
        else:
            final[node] = with_operands(node, [at_step(a) for a in node.args])
    return [at_step(root) for root in roots]


def _kept(angle: Expression) -> Expression:
    """An angle, or NaN where it has lost its digits."""
    return F.where(F.gt(F.abs(angle), LOST), math.nan, angle)


def _is_of_parameters(node: Symbol, known: set[Symbol]) -> bool:
    if node.op == "variable":
        return node.args[0] == "p"
    return node.op in OPERATIONS and all(_is_fixed(a, known) for a in node.args)


def _is_fixed(a: Expression, of_parameters: set[Symbol]) -> bool:
    return not isinstance(a, Symbol) or a in of_parameters
