"""Scalar symbols that record what a block computes.

Symbols are hash-consed: equal expressions are one object, so shared terms are computed once.
Their arithmetic is in `scalars`, arrays of them in `arrays`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NoReturn

from clie_blocks.compiled.ir.operations import operation_named
from clie_blocks.errors import ClieError


class TraceError(ClieError, TypeError):
    """A block does with a signal what a straight-line program cannot do."""


class ChangingResultError(TraceError):
    """A block gives another result at every call: no program computes what it does."""


class FrozenParameterError(Exception):
    """A block needs the value of these parameters while it is traced."""

    def __init__(self, slots: list[int]) -> None:
        super().__init__(f"parameters {slots} must be constants")
        self.slots = slots


BRANCH = ("a branch on a signal has no straight-line program; use np.where(condition, a, b), "
          "np.clip or np.sign in place of if, and, or, not, min, max")
VALUE = ("a signal has no value while the diagram is traced, so it cannot become a float, an int "
         "or an index; build arrays with np.array([...]) or np.zeros, not float(...), and look up "
         "a table by a parameter or with np.interp")


class Graph:
    """The table that makes equal expressions one object."""

    def __init__(self) -> None:
        self._known: dict[tuple, Symbol] = {}

    def __len__(self) -> int:
        return len(self._known)

    def variable(self, kind: str, index: int = 0) -> Symbol:
        """Return the variable such as ``('x', 3)``."""
        return self._node("variable", (kind, index), (kind, index), False)

    def make(self, name: str, args: tuple[Expression, ...]) -> Symbol:
        """Return the node of an operation; operands are symbols or floats."""
        key = tuple(id(a) if isinstance(a, Symbol) else a.hex() for a in args)
        return self._node(name, args, key, operation_named(name).boolean)

    def _node(self, name: str, args: tuple, key: tuple, boolean: bool) -> Symbol:
        node = self._known.get((name, key))
        if node is None:
            node = self._known[name, key] = Symbol(self, name, args, boolean)
        return node


class Symbol:
    """One scalar: a variable or an operation on symbols and floats."""

    __slots__ = ("graph", "op", "args", "boolean", "may_be_negative_zero")
    __array_ufunc__: ClassVar[Callable[..., Any]]  # numpy's functions: see `symbol_arrays`
    __array_function__: ClassVar[Callable[..., Any]]
    __hash__ = object.__hash__

    def __init__(self, graph: Graph, op: str, args: tuple, boolean: bool) -> None:
        self.graph, self.op, self.args, self.boolean = graph, op, args, boolean
        self.may_be_negative_zero = not _ZERO_IS_POSITIVE.get(op, _never)(*args)

    def __bool__(self) -> bool:
        _need_value(self, BRANCH)

    def __float__(self) -> float:
        _need_value(self, VALUE)

    __int__ = __index__ = __complex__ = __float__

    def __repr__(self) -> str:
        if self.op == "variable":
            return f"{self.args[0]}{self.args[1]}"
        return f"{self.op}({', '.join(map(repr, self.args))})"

    @property
    def real(self) -> Symbol:
        """The symbol itself: signals are real."""
        return self

    def conjugate(self) -> Symbol:
        """Return the symbol itself: signals are real."""
        return self

    @property
    def size(self) -> int:
        """One, as for a numpy scalar."""
        return 1

    @property
    def shape(self) -> tuple[()]:
        """Empty, as for a numpy scalar."""
        return ()

    @property
    def ndim(self) -> int:
        """Zero, as for a numpy scalar."""
        return 0

    def item(self) -> Symbol:
        """Return the symbol itself, as a numpy scalar does."""
        return self


Expression = Symbol | float


def may_be_negative_zero(a: Expression) -> bool:
    """Whether the value may be -0.0: to such a one the constant 0.0 adds something, a sign."""
    return a.may_be_negative_zero if isinstance(a, Symbol) else a.hex() == (-0.0).hex()


def _never(*args: Expression) -> bool:
    return False


def _either(a: Expression, b: Expression) -> bool:
    return not (may_be_negative_zero(a) and may_be_negative_zero(b))


_ZERO_IS_POSITIVE: dict[str, Callable[..., bool]] = {
    "add": _either, "abs": lambda a: True, "exp": lambda a: True, "cosh": lambda a: True,
    "sign": lambda a: True, "mul": lambda a, b: a is b,
    "sub": lambda a, b: not may_be_negative_zero(a),
    "where": lambda c, a, b: not (may_be_negative_zero(a) or may_be_negative_zero(b))}


def variables(roots: Iterable[Expression]) -> set[tuple[str, int]]:
    """Return the set of ``(kind, index)`` on which any of the expressions depends."""
    return {node.args for node in topological(roots) if node.op == "variable"}


def topological(roots: Iterable[Expression], known: Iterable[Symbol] = ()) -> list[Symbol]:
    """List every node below the roots, operands before the operations that use them.

    Nodes that are `known`, and what is below them alone, are left out.
    """
    order, seen = [], set(known)
    stack = [(root, False) for root in reversed(list(roots)) if isinstance(root, Symbol)]
    while stack:
        node, done = stack.pop()
        if done:
            order.append(node)
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            if node.op != "variable":
                stack += [(a, False) for a in reversed(node.args)
                          if isinstance(a, Symbol) and a not in seen]
    return order


def _need_value(symbol: Symbol, message: str) -> NoReturn:
    kinds = variables([symbol])
    if kinds and all(kind == "p" for kind, _ in kinds):
        raise FrozenParameterError(sorted(index for _, index in kinds))
    raise TraceError(message)
