"""Expressions as plain Python: a listing to read, and the program where llvmlite is missing."""

import functools
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.compiled.codegen.methods import Method
from clie_blocks.compiled.ir.foreign import foreign_function
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS, operation_named
from clie_blocks.compiled.ir.symbols import Expression, Symbol, topological


def source(layout: Layout, names: Mapping[Expression, str] | None = None, title: str = "",
           number: str = "", library: str = "") -> str:
    """Return the Python text of ``derivative``, ``observe`` and, if any, ``watch``.

    It computes with single numbers, or with the arrays of a library (``'torch'``), whose
    constants are then those that the function of the name `number` makes.
    """
    parts = {"derivative": layout.derivatives, "observe": layout.record}
    if layout.watch:
        parts["watch"] = layout.watch
    roots = [root for part in parts.values() for root in part]
    used = {word for node in topological(roots) if (word := _word(node.op, library))}
    header = [title] if title else []
    imports = ", ".join(_IMPORTED[library].get(word, word) for word in sorted(used))
    header += [f"from {library or 'numpy'} import {imports}"] * bool(
        used and (library or not number))
    header += ["one, zero, inf, nan = 1.0, 0.0, float('inf'), float('nan')"] * (not number)
    header += ["inf, nan = number(float('inf')), number(float('nan'))"] * bool(library)
    functions = [_function(name, part, names or {}, number, library)
                 for name, part in parts.items()]
    return "\n\n".join(["\n".join(header), *functions]).lstrip() + "\n"


def _text(name: str, library: str) -> str:
    operation = operation_named(name)
    return operation.of_arrays if library else operation.python


def _word(name: str, library: str) -> str:
    """Function that an operation calls in Python; empty where it is none of a library."""
    if name not in OPERATIONS:
        return ""
    word, bracket, _ = _text(name, library).partition("(")
    return word if bracket else ""


def _function(name: str, roots: Iterable[Expression], names: Mapping[Expression, str],
              number: str, library: str) -> str:
    lines: list[str] = []
    text: dict[Symbol, str] = {}

    def operand(a: Expression) -> str:
        return text[a] if isinstance(a, Symbol) else _constant(a, number)

    for node in topological(roots):
        if node.op == "variable":
            kind, index = node.args
            text[node] = "t" if kind == "t" else f"{kind}[{index}]"
            continue
        code = _text(node.op, library).format(*map(operand, node.args))
        text[node] = f"v{len(lines)}"
        comment = f"  # {names[node]}" if node in names else ""
        lines.append(f"    {text[node]} = {code}{comment}")
    results = ["    return [", *(f"        {operand(root)}," for root in roots), "    ]"]
    return "\n".join([f"def {name}(t, x, u, p):", *lines, *results])


def _constant(value: float, number: str) -> str:
    if not math.isfinite(value):
        return "nan" if math.isnan(value) else f"({value!r})"
    return f"{number}({value!r})" if number or value < 0 else repr(value)


class PythonEngine:
    """The program as plain Python functions; slow, without any dependency.

    Python's own floats do the work.  Where they raise (a division by zero, an overflow) the same
    text runs once more on numpy's floats, so that infinities and NaN come out as in numpy.

    Parameters
    ----------
    layout : Layout
        What to compute.
    method : Method
        The Butcher table.

    """

    cached = False

    def __init__(self, layout: Layout, method: Method) -> None:
        self.method, self._layout = method, layout
        self._plain: dict[str, Any] = {
            "opaque": self._opaque,
            "foreign": lambda number, size, *numbers: foreign_function(number)(numbers).tolist()}
        exec(compile(source(layout), "<program>", "exec"), self._plain)
        self._plain |= _PLAIN  # Python's own functions are quicker on single numbers

    @functools.cached_property
    def _careful(self) -> dict[str, Any]:
        names = {**_CAREFUL, "opaque": self._opaque,
                 "foreign": lambda number, size, *numbers: foreign_function(number)(numbers)}
        exec(compile(source(self._layout, number="number"), "<program>", "exec"), names)
        return names

    def _opaque(self, index: float, size: int, *numbers: float) -> list[float]:
        return self._layout.opaque[int(index)](np.array(numbers)).tolist()

    def derivative(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the derivatives of the states."""
        return self._at_point("derivative", t, x, u, p)

    def observe(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the record."""
        return self._at_point("observe", t, x, u, p)

    def run(self, n: int, h: float, t0: float, first: int, x: np.ndarray, inputs: np.ndarray,
            p: np.ndarray, every: int, slots: np.ndarray, log: np.ndarray) -> int:
        """Take n steps in place and return how many; fills rows of `log` every so many steps."""
        state, values, row = x.tolist(), p.tolist(), 0
        for s in range(n):
            t, u = t0 + (first + s) * h, inputs[s].tolist()
            if self._layout.watch and self._call("watch", t, state, u, values)[0]:
                x[:] = state
                return s
            if (first + s) % every == 0:
                record = self._call("observe", t, state, u, values)
                log[row] = [record[slot] for slot in slots]
                row += 1
            state = self._step(t, h, state, u, values)
        x[:] = state
        return n

    def _at_point(self, name: str, t: float, *vectors: np.ndarray) -> np.ndarray:
        return np.array(self._call(name, float(t), *(np.asarray(value, float).tolist()
                                                     for value in vectors)), dtype=float)

    def _step(self, t: float, h: float, x: list[float], u: list[float],
              p: list[float]) -> list[float]:
        if self.method.is_map:
            return self._call("derivative", t, x, u, p)
        k: list[list[float]] = []
        for weights, c in zip(self.method.a, self.method.c):
            k.append(self._call("derivative", t + c * h, _advance(x, h, weights, k), u, p))
        return _advance(x, h, self.method.b, k)

    def _call(self, name: str, t: float, x: list[float], u: list[float],
              p: list[float]) -> list[float]:
        try:
            return self._plain[name](t, x, u, p)
        except (ArithmeticError, ValueError):
            with np.errstate(all="ignore"):
                return [float(value) for value in self._careful[name](
                    np.float64(t), np.array(x), np.array(u), np.array(p))]


def _advance(x: list[float], h: float, weights: Sequence[float],
             k: list[list[float]]) -> list[float]:
    terms = [(weight, rate) for weight, rate in zip(weights, k) if weight]
    if not terms:
        return x
    # one after the other, as the machine does: from Python 3.12 on sum() carries the lost digits
    def rate_of(i: int) -> float:
        return functools.reduce(operator.add, (weight * rate[i] for weight, rate in terms))

    return [value + h * rate_of(i) for i, value in enumerate(x)]


def _rounding(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda a: math.copysign(float(function(a)), a)


def _power(a: float, b: float) -> float:
    return np.power(np.array([a]), np.array([b]))[0]  # a scalar power 0.5 would be a root


_IMPORTED = {"": {"pow": "power as pow"}, "torch": {"rint": "round as rint"}}
_LIBM = [name for name, operation in OPERATIONS.items()
         if operation.python.startswith(f"{name}(")]
_MATH = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2",
         "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh"}
_PLAIN: dict[str, Any] = {name: getattr(math, _MATH.get(name, name), None) for name in _LIBM}
_PLAIN |= {name: _rounding(getattr(math, name)) for name in ("floor", "ceil", "trunc")}
_PLAIN |= {"rint": _rounding(round), "abs": abs, "cbrt": math.cbrt}
_CAREFUL: dict[str, Any] = {name: OPERATIONS[name].numpy for name in _LIBM}
_CAREFUL |= {"pow": _power, "number": np.float64, "one": np.float64(1.0),
             "zero": np.float64(0.0), "inf": np.float64("inf"), "nan": np.float64("nan")}
