"""Arrays of symbols: what numpy's functions mean on signals."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.compiled.frontend import linear_algebra
from clie_blocks.compiled.ir.scalars import (
    FUNCTIONS,
    F,
    floor_divide,
    mod,
    number,
    round_to,
    truth,
)
from clie_blocks.compiled.ir.symbols import Expression, Symbol, TraceError
from clie_blocks.errors import nearest


def _clip(a: Expression, low: Expression | None, high: Expression | None) -> Expression:
    a = a if low is None else F.maximum(a, low)
    return a if high is None else F.minimum(a, high)


def _is_nan(a: Expression) -> Expression:
    return F.ne(a, a)


def _is_finite(a: Expression) -> Expression:
    return F.lt(F.abs(a), np.inf)


def _heaviside(a: Expression, at_zero: Expression) -> Expression:
    return F.where(F.eq(a, 0.0), at_zero, F.where(F.gt(a, 0.0), 1.0, F.where(F.lt(a, 0), 0.0, a)))


def _xor(a: Expression, b: Expression) -> Expression:
    return F.ne(number(truth(a)), number(truth(b)))


_UFUNCS: dict[np.ufunc, Callable[..., Any]] = {
    np.add: F.add, np.subtract: F.sub, np.multiply: F.mul, np.true_divide: F.div,
    np.negative: F.neg, np.positive: number, np.power: F.pow, np.float_power: F.pow,
    np.absolute: F.abs, np.fabs: F.abs, np.conjugate: number,
    np.maximum: F.maximum, np.minimum: F.minimum,
    np.fmax: lambda a, b: F.where(_is_nan(a), b, F.where(_is_nan(b), a, F.maximum(a, b))),
    np.fmin: lambda a, b: F.where(_is_nan(a), b, F.where(_is_nan(b), a, F.minimum(a, b))),
    np.less: F.lt, np.less_equal: F.le, np.greater: F.gt, np.greater_equal: F.ge,
    np.equal: F.eq, np.not_equal: F.ne,
    np.logical_and: FUNCTIONS["and"], np.logical_or: FUNCTIONS["or"],
    np.logical_not: FUNCTIONS["not"], np.logical_xor: _xor,
    np.bitwise_and: FUNCTIONS["and"], np.bitwise_or: FUNCTIONS["or"],
    np.invert: FUNCTIONS["not"], np.bitwise_xor: _xor,
    np.remainder: mod, np.floor_divide: floor_divide,
    np.square: lambda a: F.mul(a, a), np.reciprocal: lambda a: F.div(1.0, a),
    np.exp2: lambda a: F.pow(2.0, a), np.heaviside: _heaviside,
    np.radians: lambda a: F.mul(a, np.pi / 180), np.deg2rad: lambda a: F.mul(a, np.pi / 180),
    np.degrees: lambda a: F.mul(a, 180 / np.pi), np.rad2deg: lambda a: F.mul(a, 180 / np.pi),
    np.isnan: _is_nan, np.isfinite: _is_finite,
    np.isinf: lambda a: F.eq(F.abs(a), np.inf),
}
for _name in ("sqrt floor ceil trunc rint sign sin cos tan arcsin arccos arctan sinh cosh tanh "
              "arcsinh arccosh arctanh exp expm1 log log1p log2 log10 cbrt arctan2 hypot fmod "
              "copysign").split():
    _UFUNCS[getattr(np, _name)] = FUNCTIONS[_name]
_ELEMENTWISE = {ufunc: np.frompyfunc(function, ufunc.nin, 1)
                for ufunc, function in _UFUNCS.items()}
_FROM_ZERO = np.frompyfunc(lambda a: F.add(0.0, a), 1, 1)
_SUMS = frozenset({np.dot, np.inner, np.vdot, np.tensordot, np.einsum})
_WHERE = np.frompyfunc(F.where, 3, 1)
_CLIP = np.frompyfunc(_clip, 3, 1)

_ROUND = np.frompyfunc(round_to, 2, 1)


class SymbolArray(np.ndarray):
    """Object array of symbols and floats that keeps numpy's functions symbolic."""

    @property  # type: ignore[misc]  # nothing is written to it
    def real(self) -> Any:
        """The signal, which is a real number; from NumPy 2.5 on objects are asked for theirs."""
        return self

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        return _call_ufunc(ufunc, method, inputs, options)

    def __array_function__(self, function: Callable[..., Any], types: Any, args: Any,
                           kwargs: Any) -> Any:
        return _call_function(function, args, kwargs)

    def astype(self, dtype: Any, *options: Any, **named: Any) -> Any:
        """Return a copy; signals stay symbols."""
        return self.copy()

    def clip(self, min: Any = None, max: Any = None, *options: Any, **named: Any) -> Any:
        """Return the array limited to an interval."""
        return np.clip(self, min, max)

    def round(self, decimals: Any = 0, *options: Any, **named: Any) -> Any:
        """Return the array rounded, half to even."""
        return np.round(self, decimals)


def symbol_array(values: Any) -> SymbolArray:
    """Object array of nested lists of symbols and numbers."""
    return np.array(_plain(values), dtype=object).view(SymbolArray)


def array_of(values: Sequence[Any]) -> np.ndarray:
    """Scalars as an array: of symbols where any is one, else of numbers."""
    return symbol_array(values) if has_symbols(values) else np.array(values, float)


def has_symbols(value: object) -> bool:
    """Return whether a scalar, list, tuple or array holds a symbol."""
    if isinstance(value, (list, tuple)):
        return any(has_symbols(item) for item in value)
    if isinstance(value, np.ndarray):
        return value.dtype == object and any(isinstance(item, Symbol) for item in value.flat)
    return isinstance(value, Symbol)


def flat_scalars(value: Any) -> list[Expression]:
    """Return what a block returned as a flat list of symbols and floats."""
    if isinstance(value, (list, tuple)):
        return [scalar for item in value for scalar in flat_scalars(item)]
    if isinstance(value, np.ndarray):
        return [number(item) for item in value.reshape(-1)]
    return [number(value)]


def _plain(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value.view(np.ndarray) if isinstance(value, SymbolArray) else value


def _objects(value: Any) -> np.ndarray:
    return np.asarray(_plain(value), dtype=object)


def _wrap(result: Any) -> Any:
    if isinstance(result, np.ndarray) and result.dtype == object:
        return result.view(SymbolArray) if result.ndim else result.item()
    return result


def _call_ufunc(ufunc: np.ufunc, method: str, inputs: Sequence[Any],
                options: dict[str, Any]) -> Any:
    target = options.pop("out", (None,))[0]
    if ufunc is np.power and isinstance(inputs[1], float) and inputs[1] == 0.5:
        ufunc, inputs = np.sqrt, inputs[:1]  # as numpy does: not the power where x is -0 or -inf
    if ufunc is np.matmul:
        result = _from_zero(ufunc(*map(_objects, inputs)))
    elif ufunc in _ELEMENTWISE:
        if isinstance(options.get("where", True), np.ndarray):
            raise TraceError(f"np.{ufunc.__name__}(where=...) cannot be traced; use np.where")
        kept = {key: options[key] for key in ("axis", "keepdims") if key in options}
        operands = [_objects(inputs[0]), *inputs[1:]] if method != "__call__" else map(
            _objects, inputs)
        result = getattr(_ELEMENTWISE[ufunc], method)(*operands, **kept)
        if ufunc is np.add and method == "reduce":
            result = _from_zero(result)
    else:
        known = sorted(known.__name__ for known in _ELEMENTWISE)
        raise TraceError(f"np.{ufunc.__name__} cannot be traced on a signal; "
                         f"{nearest(ufunc.__name__, known)}")
    if target is None:
        return _wrap(result)
    if target.dtype != object:
        raise TraceError("a signal is written into an array of constants; build the array with "
                         "np.zeros or np.array([...]) inside the block")
    target.view(np.ndarray)[...] = result
    return target


def _from_zero(sums: Any) -> Any:
    """Sums as numpy has them, which start at 0.0; those of objects start with the first term."""
    return _FROM_ZERO(_plain(sums)) if isinstance(sums, np.ndarray) else F.add(0.0, sums)


def _call_function(function: Callable[..., Any], args: Sequence[Any],
                   kwargs: Mapping[str, Any]) -> Any:
    if function in _ARRAY_FUNCTIONS:
        return _wrap(_ARRAY_FUNCTIONS[function](*args, **kwargs))
    lifted = [_lift(value) for value in args]
    named = {key: _lift(value) for key, value in kwargs.items() if key != "dtype"}
    result = np.ndarray.__array_function__(
        np.empty(0, object).view(SymbolArray), function, (SymbolArray,), tuple(lifted), named)
    return _wrap(_from_zero(result) if function in _SUMS else result)


def _lift(value: Any) -> Any:
    if isinstance(value, Symbol):
        return np.array(value, dtype=object).view(SymbolArray)
    if isinstance(value, (list, tuple)):
        return type(value)(_lift(item) for item in value)
    return value


def _where(condition: Any, *branches: Any) -> np.ndarray:
    if len(branches) != 2:
        raise TraceError("np.where(condition) gives indices, which a signal cannot; "
                         "use np.where(condition, a, b)")
    return _WHERE(*map(_objects, (condition, *branches)))


def _clip_function(a: Any, a_min: Any = None, a_max: Any = None, *, min: Any = None,
                   max: Any = None, **options: Any) -> np.ndarray:
    low = a_min if a_min is not None else min
    high = a_max if a_max is not None else max
    return _CLIP(*map(_objects, (a, low, high)))


def _round_function(a: Any, decimals: int = 0, out: None = None) -> np.ndarray:
    return _ROUND(_objects(a), decimals)


def _interp(x: Any, xp: Any, fp: Any, left: float | None = None, right: float | None = None,
            period: float | None = None) -> Any:
    if period is not None or left is not None or right is not None or has_symbols([xp, fp]):
        raise TraceError("np.interp is traced for a constant table without left, right, period")
    xp, fp = np.asarray(xp, float), np.asarray(fp, float)
    slopes = np.diff(fp) / np.diff(xp)
    return sum((slope * np.clip(x - start, 0.0, width)
                for slope, start, width in zip(slopes, xp, np.diff(xp))), fp[0])


def _nan_to_num(x: Any, copy: bool = True, nan: float = 0.0, posinf: float | None = None,
                neginf: float | None = None) -> Any:
    limits = np.finfo(float)
    posinf, neginf = (limits.max if posinf is None else posinf,
                      limits.min if neginf is None else neginf)
    bounded = np.where(x == np.inf, posinf, np.where(x == -np.inf, neginf, x))
    return np.where(np.isnan(x), nan, bounded)


_ARRAY_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.nan_to_num: _nan_to_num,
    np.where: _where, np.clip: _clip_function, np.round: _round_function,
    np.around: _round_function, np.interp: _interp,
    np.isscalar: lambda value: True,
    np.linalg.solve: linear_algebra.solve, np.linalg.inv: linear_algebra.inv,
    np.linalg.det: linear_algebra.det, np.linalg.norm: linear_algebra.norm,
}

Symbol.__array_ufunc__ = lambda self, ufunc, method, *inputs, **options: _call_ufunc(
    ufunc, method, inputs, options)
Symbol.__array_function__ = lambda self, function, types, args, kwargs: _call_function(
    function, args, kwargs)
