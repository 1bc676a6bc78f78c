"""Twins of plain Python functions that see symbolic numpy and math instead of the real ones.

A block's function is not changed: its code object runs once more with other globals.  Functions
that it reaches through globals, closures, defaults, partials or bound methods get twins as well,
wherever they are defined, as long as they are plain Python.
"""

import functools
import math
import types
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from clie_blocks.compiled.frontend.symbol_arrays import SymbolArray, has_symbols, symbol_array
from clie_blocks.compiled.ir.scalars import F
from clie_blocks.compiled.ir.symbols import ChangingResultError, Symbol


def twin(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function that computes the same on symbols."""
    follower = _Follower()
    call = type(function).__call__
    if isinstance(call, types.FunctionType) and not isinstance(function, functools.partial):
        return types.MethodType(follower.follow(call), function)
    return follower.follow(function)


class _Follower:
    """Twins made so far, and those whose globals and closures still wait to be followed."""

    def __init__(self) -> None:
        self._made: dict[int, types.FunctionType] = {}
        self._waiting: list[tuple[types.FunctionType, types.FunctionType]] = []

    def follow(self, value: Any) -> Any:
        """Return the twin of a value, complete with all that it reaches."""
        made = self._twin(value)
        while self._waiting:
            self._complete(*self._waiting.pop())
        return made

    def _twin(self, value: Any) -> Any:
        if id(value) in _REPLACED:
            return _REPLACED[id(value)][1]
        if id(value) in self._made:
            return self._made[id(value)]
        if _changing_module(value):
            return _Refused(value, _changing_module(value))
        if isinstance(value, types.FunctionType):
            return self._function(value)
        if isinstance(value, functools.partial):
            return functools.partial(self._twin(value.func), *value.args, **value.keywords)
        if isinstance(value, types.MethodType):
            return types.MethodType(self._twin(value.__func__), value.__self__)
        if isinstance(value, types.ModuleType):
            return _ModuleTwin(value, self)
        return value

    def _function(self, function: types.FunctionType) -> types.FunctionType:
        scope = {"__builtins__": _BUILTINS, "__name__": function.__module__}
        cells = tuple(types.CellType() for _ in function.__closure__ or ())
        made = types.FunctionType(function.__code__, scope, function.__name__, None, cells)
        self._made[id(function)] = made
        self._waiting.append((function, made))
        return made

    def _complete(self, function: types.FunctionType, made: types.FunctionType) -> None:
        for name in _names(function.__code__):
            if name in function.__globals__:
                made.__globals__[name] = self._twin(function.__globals__[name])
        for mine, theirs in zip(made.__closure__ or (), function.__closure__ or ()):
            mine.cell_contents = self._twin(theirs.cell_contents)
        made.__defaults__ = function.__defaults__ and tuple(
            self._twin(value) for value in function.__defaults__)
        made.__kwdefaults__ = function.__kwdefaults__ and {
            key: self._twin(value) for key, value in function.__kwdefaults__.items()}


class _ModuleTwin:
    """A module whose functions are twins."""

    def __init__(self, module: types.ModuleType, follower: _Follower) -> None:
        self._module, self._follower = module, follower

    def __getattr__(self, name: str) -> Any:
        return self._follower.follow(getattr(self._module, name))


# Modules whose results change from call to call, so that one of them must not stay in a program.
_RANDOM = "draws random numbers: make noise an input of the diagram"
_CHANGING = {"time": "reads the clock: the time of the run is the argument t", "random": _RANDOM,
             "secrets": _RANDOM, "uuid": _RANDOM, "numpy.random": _RANDOM}


def _changing_module(value: Any) -> str:
    """Name of the module of `_CHANGING` that a value is or belongs to, else empty."""
    if isinstance(value, types.ModuleType):
        name = value.__name__
    elif isinstance(value, types.BuiltinFunctionType):
        owner = value.__self__
        name = owner.__name__ if isinstance(owner, types.ModuleType) else type(owner).__module__
    elif isinstance(value, types.MethodType):
        name = type(value.__self__).__module__
    else:
        name = type(value).__module__
    if name.startswith("numpy.random."):
        return "numpy.random"
    return name if name in _CHANGING else ""


class _Refused:
    """A module, function or generator that cannot be traced: every use of it says so."""

    def __init__(self, value: Any, module: str) -> None:
        self._value, self._module = value, module

    def __getattr__(self, name: str) -> Any:
        return _Refused(getattr(self._value, name), self._module)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        raise ChangingResultError(f"module {self._module} {_CHANGING[self._module]}")


def _names(code: types.CodeType) -> set[str]:
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


class _Numpy:
    """Numpy as a block sees it: work arrays hold symbols, lists of symbols become arrays."""

    def __init__(self, module: types.ModuleType) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._module, name)
        if id(value) in _REPLACED:
            return _REPLACED[id(value)][1]
        if _changing_module(value):
            return _Refused(value, _changing_module(value))
        if isinstance(value, (type, types.ModuleType)) or not callable(value):
            return value
        return _with_symbol_arrays(value)


def _with_symbol_arrays(function: Callable[..., Any]) -> Callable[..., Any]:
    def call(*args: Any, **kwargs: Any) -> Any:
        return function(*(_lift(value) for value in args),
                        **{key: _lift(value) for key, value in kwargs.items()})
    return call


def _lift(value: Any) -> Any:
    if not isinstance(value, (list, tuple)) or not has_symbols(value):
        return value
    if all(np.ndim(item) == 0 for item in value):
        return symbol_array(value)
    return type(value)(_lift(item) for item in value)


def _array(values: Any, dtype: DTypeLike | None = None, *, ndmin: int = 0, copy: bool = True,
           **options: Any) -> np.ndarray:
    if not has_symbols(values):
        return np.array(values, dtype, ndmin=ndmin, copy=copy, **options)
    made = symbol_array(values)
    return made.reshape((1,) * (ndmin - made.ndim) + made.shape)


def _asarray(values: Any, dtype: DTypeLike | None = None, **options: Any) -> np.ndarray:
    if isinstance(values, SymbolArray):
        return values
    return symbol_array(values) if has_symbols(values) else np.asarray(values, dtype, **options)


def _at_least_1d(*values: Any) -> Any:
    made = [np.atleast_1d(_asarray(value)) for value in values]
    return made[0] if len(made) == 1 else made


def _work_array(creator: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    def create(*args: Any, **kwargs: Any) -> np.ndarray:
        made = creator(*args, **kwargs)
        return made.astype(object).view(SymbolArray) if made.dtype == float else made
    return create


def _work_array_like(fill: float) -> Callable[..., np.ndarray]:
    def create(like: Any, *options: Any, **named: Any) -> np.ndarray:
        return np.full(np.shape(like), fill).astype(object).view(SymbolArray)
    return create


def _full(shape: Any, value: Any, dtype: DTypeLike | None = None, **options: Any) -> np.ndarray:
    made = np.empty(shape, object).view(SymbolArray)
    made[...] = value
    return made


def _full_like(like: Any, value: Any, **options: Any) -> np.ndarray:
    return _full(np.shape(like), value)


def _extreme(name: str, builtin: Callable[..., Any]) -> Callable[..., Any]:
    def extreme(*args: Any, **kwargs: Any) -> Any:
        values = args if len(args) > 1 else tuple(args[0])
        if kwargs or not has_symbols(values):
            return builtin(*args, **kwargs)
        return functools.reduce(getattr(F, name), values)
    return extreme


def _math_twin(function: Callable[..., float], traced: Callable[..., Any]) -> Callable[..., Any]:
    def call(*args: Any) -> Any:
        return traced(*args) if any(isinstance(a, Symbol) for a in args) else function(*args)
    return call


class _Math:
    """Module math with symbols allowed."""

    def __getattr__(self, name: str) -> Any:
        value = getattr(math, name)
        return _REPLACED[id(value)][1] if id(value) in _REPLACED else value


NUMPY, LINALG, MATH = _Numpy(np), _Numpy(np.linalg), _Math()
_MATH_NAMES = {
    "asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "asinh": "arcsinh",
    "acosh": "arccosh", "atanh": "arctanh", "fabs": "abs"}
_REPLACED = {id(real): (real, replacement) for real, replacement in [
    (np, NUMPY), (np.linalg, LINALG), (math, MATH),
    (np.array, _array), (np.asarray, _asarray), (np.asanyarray, _asarray),
    (np.ascontiguousarray, _asarray), (np.atleast_1d, _at_least_1d),
    *((creator, _work_array(creator)) for creator in (np.zeros, np.empty, np.ones, np.eye,
                                                      np.identity)),
    (np.zeros_like, _work_array_like(0.0)), (np.empty_like, _work_array_like(0.0)),
    (np.ones_like, _work_array_like(1.0)), (np.full, _full), (np.full_like, _full_like),
    (math.radians, _math_twin(math.radians, np.radians)),
    (math.degrees, _math_twin(math.degrees, np.degrees)),
    *((getattr(math, name),
       _math_twin(getattr(math, name), getattr(F, _MATH_NAMES.get(name, name))))
      for name in ("sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp expm1 "
                   "log1p log2 log10 sqrt hypot fmod copysign fabs floor ceil trunc pow").split()),
    (math.log, _math_twin(math.log, lambda a, base=None: F.log(a) if base is None
                          else F.div(F.log(a), F.log(base)))),
]}


def _import(name: str, *args: Any, **kwargs: Any) -> Any:
    module = __import__(name, *args, **kwargs)
    if _changing_module(module):
        return _Refused(module, _changing_module(module))
    return _REPLACED[id(module)][1] if id(module) in _REPLACED else module


_BUILTINS = dict(vars(__import__("builtins")),
                 min=_extreme("minimum", min), max=_extreme("maximum", max), __import__=_import)
