"""Arithmetic on symbols, folding constants.

Every simplification holds for every IEEE value: signed zeros, infinities and NaN included.  So
``0 * x`` stays, which is NaN where x is infinite, and ``0 - x`` is not ``-x``, whose zero has the
other sign: ``arctan2(0 - x, -1)`` at x = 0 is pi, not -pi.  Only the last digit may differ, of
small powers, which become products.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.compiled.ir.operations import CALLBACKS, OPERATIONS
from clie_blocks.compiled.ir.symbols import Expression, Symbol, may_be_negative_zero


def apply(name: str, *args: Any) -> Expression:
    """Apply an operation of the table to symbols and numbers, with constants folded."""
    operands = _typed(name, args)
    graph = next((a.graph for a in operands if isinstance(a, Symbol)), None)
    if graph is None:
        with np.errstate(all="ignore"):
            value = OPERATIONS[name].numpy(*operands)
        return bool(value) if OPERATIONS[name].boolean else float(value)
    simple = _SIMPLER[name](*operands) if name in _SIMPLER else None
    return graph.make(name, operands) if simple is None else simple


def with_operands(node: Symbol, operands: Sequence[Expression]) -> Expression:
    """Return a node's operation on other operands; the node itself where they are its own."""
    if all(new is old for new, old in zip(operands, node.args)):
        return node
    return FUNCTIONS[node.op](*operands)


def _typed(name: str, args: tuple[Any, ...]) -> tuple[Expression, ...]:
    if name in ("and", "or", "not"):
        return tuple(truth(a) for a in args)
    if name == "where":
        return (truth(args[0]), number(args[1]), number(args[2]))
    return tuple(number(a) for a in args)


def number(a: Any) -> Expression:
    """Return a scalar as a number: true is 1."""
    if isinstance(a, Symbol):
        return a.graph.make("where", (a, 1.0, 0.0)) if a.boolean else a
    return float(a)


def truth(a: Any) -> Symbol | bool:
    """Return a scalar as a truth value: anything but 0 is true."""
    if isinstance(a, Symbol):
        return a if a.boolean else a.graph.make("ne", (a, 0.0))
    return bool(a)


def _is(a: Expression, value: float) -> bool:
    return not isinstance(a, Symbol) and a == value


def _is_zero(a: Expression, sign: float) -> bool:
    return not isinstance(a, Symbol) and a == 0.0 and math.copysign(1.0, a) == sign


def _simpler_add(a: Expression, b: Expression) -> Expression | None:
    return b if _is_neutral(a, b) else a if _is_neutral(b, a) else None


def _is_neutral(zero: Expression, term: Expression) -> bool:
    """Whether this is a zero that changes no value of the other term of a sum."""
    return _is_zero(zero, -1.0) or _is_zero(zero, 1.0) and not may_be_negative_zero(term)


def _simpler_sub(a: Expression, b: Expression) -> Expression | None:
    return a if _is_zero(b, 1.0) else apply("neg", b) if _is_zero(a, -1.0) else None


def _simpler_mul(a: Expression, b: Expression) -> Expression | None:
    if _is(a, 1.0) or _is(b, 1.0):
        return b if _is(a, 1.0) else a
    if _is(a, -1.0) or _is(b, -1.0):
        return apply("neg", b if _is(a, -1.0) else a)
    return None


def _simpler_div(a: Expression, b: Expression) -> Expression | None:
    return a if _is(b, 1.0) else None


def _simpler_neg(a: Symbol) -> Expression | None:
    return a.args[0] if a.op == "neg" else None


def _simpler_pow(a: Expression, b: Expression) -> Expression | None:
    if _is(b, 0.0):
        return 1.0
    if not isinstance(b, Symbol) and b in (1.0, 2.0, 3.0, 4.0):
        square = apply("mul", a, a)
        return {1.0: a, 2.0: square, 3.0: apply("mul", square, a),
                4.0: apply("mul", square, square)}[b]
    return apply("div", 1.0, a) if _is(b, -1.0) else None


def _simpler_where(c: Expression, a: Expression, b: Expression) -> Expression | None:
    if not isinstance(c, Symbol):
        return a if c else b
    same = a is b or (not isinstance(a, Symbol) and not isinstance(b, Symbol)
                      and a.hex() == b.hex())
    return a if same else None


def _simpler_and(a: Expression, b: Expression) -> Expression | None:
    return _simpler_logic(a, b, absorbing=False)


def _simpler_or(a: Expression, b: Expression) -> Expression | None:
    return _simpler_logic(a, b, absorbing=True)


def _simpler_logic(a: Expression, b: Expression, absorbing: bool) -> Expression | None:
    if isinstance(a, bool):
        a, b = b, a
    if isinstance(b, bool):
        return b if b is absorbing else a
    return a if a is b else None


_SIMPLER: dict[str, Callable[..., Expression | None]] = {
    "add": _simpler_add, "sub": _simpler_sub, "mul": _simpler_mul, "div": _simpler_div,
    "neg": _simpler_neg, "pow": _simpler_pow, "where": _simpler_where, "and": _simpler_and,
    "or": _simpler_or}


def _scalar(name: str) -> Callable[..., Any]:
    def function(*args: Any) -> Expression:
        return apply(name, *args)
    function.__name__ = name
    return function


def _call(name: str) -> Callable[..., Any]:
    """An operation whose values are no scalars, or that chooses one of them."""
    def function(*args: Any) -> Any:
        symbol = next((a for a in args if isinstance(a, Symbol)), None)
        if symbol is None:
            return CALLBACKS[name].numpy(*args)
        return symbol.graph.make(name, tuple(number(a) for a in args))
    function.__name__ = name
    return function


FUNCTIONS = ({name: _scalar(name) for name in OPERATIONS}
             | {name: _call(name) for name in CALLBACKS})


class _Functions:
    """Every operation as an attribute, for the derivative column of the table."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        return FUNCTIONS[name.rstrip("_")]


F = _Functions()


def mod(a: Expression, b: Expression) -> Any:
    """Remainder with the sign of the divisor, as ``np.mod``."""
    rest = F.fmod(a, b)
    turned = F.where(F.ne(number(F.lt(b, 0.0)), number(F.lt(rest, 0.0))), F.add(rest, b), rest)
    return F.where(F.eq(rest, 0.0), F.copysign(0.0, b), turned)


def round_to(a: Expression, decimals: int = 0) -> Any:
    """Round to decimals as numpy does: scale, round half to even, scale back."""
    if decimals == 0:
        return F.rint(a)
    scale = 10.0 ** abs(decimals)
    if decimals > 0:
        return F.div(F.rint(F.mul(a, scale)), scale)
    return F.mul(F.rint(F.div(a, scale)), scale)


def floor_divide(a: Expression, b: Expression) -> Any:
    """Quotient rounded down, as ``np.floor_divide``."""
    quotient = F.div(F.sub(a, mod(a, b)), b)
    down = F.floor(quotient)
    return F.where(F.gt(F.sub(quotient, down), 0.5), F.add(down, 1.0), down)


def _operator(name: str, reverse: bool = False) -> Callable[[Symbol, Any], Any]:
    def method(self: Symbol, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if not isinstance(other, (Symbol, int, float, np.number, np.bool_)):
            return NotImplemented
        return FUNCTIONS[name](other, self) if reverse else FUNCTIONS[name](self, other)
    return method


def _prefix(name: str) -> Callable[..., Any]:
    return lambda self, *options: FUNCTIONS[name](self, *options)


for _name, _op in (("add", "add"), ("sub", "sub"), ("mul", "mul"), ("truediv", "div"),
                   ("pow", "pow")):
    setattr(Symbol, f"__{_name}__", _operator(_op))
    setattr(Symbol, f"__r{_name}__", _operator(_op, reverse=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Symbol, f"__{_name}__", _operator(_name))
FUNCTIONS |= {"mod": mod, "floordiv": floor_divide, "pos": number,
              "round": lambda a, digits=0: round_to(a, digits or 0)}
for _name in ("mod", "floordiv", "and", "or"):
    setattr(Symbol, f"__{_name}__", _operator(_name))
    setattr(Symbol, f"__r{_name}__", _operator(_name, reverse=True))
for _name, _op in (("neg", "neg"), ("abs", "abs"), ("invert", "not"), ("floor", "floor"),
                   ("ceil", "ceil"), ("trunc", "trunc"), ("pos", "pos"), ("round", "round")):
    setattr(Symbol, f"__{_name}__", _prefix(_op))
