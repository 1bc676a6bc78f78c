"""Expressions as plain Python: a listing to read, and the program where llvmlite is missing."""

import math

import numpy as np

from clie_blocks.compiled.operations import OPERATIONS
from clie_blocks.compiled.symbols import Symbol, topological


def source(layout, names, title=""):
    """Return the Python text of ``derivative`` and ``observe``.

    Parameters
    ----------
    layout : Layout
        What to compute.
    names : dict
        Comment by expression, such as ``'plant.u[0]'``.
    title : str
        First line.

    """
    return "\n\n".join([title, _function("derivative", layout.derivatives, names),
                        _function("observe", layout.record, names)]).lstrip()


def _function(name, roots, names):
    lines, text = [], {}
    for node in topological(roots):
        if node.op == "variable":
            kind, index = node.args
            text[node] = "t" if kind == "t" else f"{kind}[{index}]"
            continue
        operands = [text[a] if isinstance(a, Symbol) else _constant(a) for a in node.args]
        text[node] = f"v{len(lines)}"
        comment = f"  # {names[node]}" if node in names else ""
        lines.append(f"    {text[node]} = {OPERATIONS[node.op].python.format(*operands)}{comment}")
    results = ["    return [", *(
        f"        {text[root] if isinstance(root, Symbol) else _constant(root)},"
        for root in roots), "    ]"]
    return "\n".join([f"def {name}(t, x, u, p):", *lines, *results])


def _constant(value):
    return f"number({value!r})" if math.isfinite(value) else f"number('{value!r}')"


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

    def __init__(self, layout, method):
        text = source(layout, {})
        self.method = method
        self._plain, self._careful = _PLAIN | {}, _CAREFUL | {}
        exec(compile(text.replace("number(", "("), "<program>", "exec"), self._plain)
        exec(compile(text, "<program>", "exec"), self._careful)

    def derivative(self, t, x, u, p):
        """Return the derivatives of the states."""
        return np.array(self._call("derivative", t, list(x), list(u), list(p)), dtype=float)

    def observe(self, t, x, u, p):
        """Return the record."""
        return np.array(self._call("observe", t, list(x), list(u), list(p)), dtype=float)

    def run(self, n, h, t0, first, x, inputs, p, every, slots, log):
        """Take n steps in place; rows of `log` are filled every so many steps."""
        state, p, row = x.tolist(), list(p), 0
        for s in range(n):
            t, u = t0 + (first + s) * h, inputs[s].tolist()
            if (first + s) % every == 0:
                record = self._call("observe", t, state, u, p)
                log[row] = [record[slot] for slot in slots]
                row += 1
            state = self._step(t, h, state, u, p)
        x[:] = state

    def _step(self, t, h, x, u, p):
        k = []
        for weights, c in zip(self.method.a, self.method.c):
            k.append(self._call("derivative", t + c * h, _advance(x, h, weights, k), u, p))
        return _advance(x, h, self.method.b, k)

    def _call(self, name, t, x, u, p):
        try:
            return self._plain[name](t, x, u, p)
        except (ArithmeticError, ValueError, TypeError):
            with np.errstate(all="ignore"):
                return [float(value) for value in self._careful[name](
                    np.float64(t), np.array(x), np.array(u), np.array(p))]


def _advance(x, h, weights, k):
    terms = [(weight, rate) for weight, rate in zip(weights, k) if weight]
    if not terms:
        return x
    return [value + h * sum(weight * rate[i] for weight, rate in terms)
            for i, value in enumerate(x)]


def _rounding(function):
    return lambda a: math.copysign(float(function(a)), a)


_LIBM = [name for name, operation in OPERATIONS.items()
         if operation.python.startswith(f"{name}(")]
_MATH = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2",
         "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh"}
_PLAIN = {name: getattr(math, _MATH.get(name, name), None) for name in _LIBM}
_PLAIN |= {name: _rounding(getattr(math, name)) for name in ("floor", "ceil", "trunc")}
_PLAIN |= {"rint": _rounding(round), "abs": abs, "one": 1.0, "zero": 0.0, "cbrt": math.cbrt}
_CAREFUL = {name: OPERATIONS[name].numpy for name in _LIBM}
_CAREFUL |= {"number": np.float64, "one": np.float64(1.0), "zero": np.float64(0.0)}
