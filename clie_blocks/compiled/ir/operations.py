"""The one table of scalar operations: numpy meaning, text in each language, derivative.

Everything that a traced diagram can compute is a row here.  Tracing builds rows, each emitter
reads one column, and forward sensitivities read the last one.  Apart from the table stand the
calls of functions that no trace shows, in Python or in C, and the choice of one of their values.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from clie_blocks.compiled.ir.foreign import foreign_function
from clie_blocks.errors import ClieError


@dataclass(frozen=True)
class Operation:
    """One scalar operation.

    Parameters
    ----------
    name : str
        Name in the program.
    arity : int
        Number of operands.
    numpy : callable
        What the operation means.
    python, c : str
        Text with ``{0}``, ``{1}`` for the operands.
    llvm : callable
        ``llvm(ir, *operands)`` emits instructions through the `ir` builder, for any lane width.
    partials : callable
        ``partials(f, y, *operands)`` returns one derivative per operand; `f` has every operation
        as an attribute, `y` is the result.
    boolean : bool
        The result is a truth value.
    tangent : callable, optional
        ``tangent(f, y, operands, tangents)`` for an operation that chooses: the derivative of
        the operand that is taken, whatever the other's is.
    array : str
        Text in Python with arrays for operands, where it is another than `python`.

    """

    name: str
    arity: int
    numpy: Callable[..., Any]
    python: str
    c: str
    llvm: Callable[..., Any]
    partials: Callable[..., Any]
    boolean: bool = False
    tangent: Callable[..., Any] | None = None
    array: str = ""

    @property
    def of_arrays(self) -> str:
        """Text in Python with arrays for operands, in the words of numpy and PyTorch."""
        return self.array or self.python


def _infix(name: str, sign: str, function: Callable[..., Any], instruction: str,
           partials: Callable[..., tuple]) -> Operation:
    text = f"{{0}} {sign} {{1}}"
    return Operation(name, 2, function, text, text,
                     lambda ir, a, b: ir.arithmetic(instruction, a, b), partials)


def _compare(name: str, sign: str, function: Callable[..., Any], predicate: str) -> Operation:
    text = f"{{0}} {sign} {{1}}"
    return Operation(name, 2, function, text, text,
                     lambda ir, a, b: ir.compare(predicate, a, b), _flat, boolean=True)


def _libm(name: str, function: Callable[..., Any], partials: Callable[..., tuple], arity: int = 1,
          c: str | None = None) -> Operation:
    operands = ", ".join(f"{{{k}}}" for k in range(arity))
    return Operation(name, arity, function, f"{name}({operands})", f"{c or name}({operands})",
                     lambda ir, *a: ir.libm(c or name, *a), partials)


def _intrinsic(name: str, function: Callable[..., Any], partials: Callable[..., tuple],
               c: str | None = None, python: str | None = None) -> Operation:
    return Operation(name, 1, function, python or f"{name}({{0}})", f"{c or name}({{0}})",
                     lambda ir, a: ir.intrinsic(c or name, a), partials)


def _flat(f: Any, y: Any, *operands: Any) -> tuple[float, ...]:
    return (0.0,) * len(operands)


def _sign_llvm(ir: Any, a: Any) -> Any:
    zero_or_nan = ir.select(ir.compare("oeq", a, 0.0), 0.0, a)
    not_positive = ir.select(ir.compare("olt", a, 0.0), -1.0, zero_or_nan)
    return ir.select(ir.compare("ogt", a, 0.0), 1.0, not_positive)


def _extremum(name: str, function: Callable[..., Any], sign: str, predicate: str) -> Operation:
    pick = f"{{0}} {sign} {{1}} %s {{0}} != {{0}}"
    return Operation(
        name, 2, function, f"({{0}} if {pick % 'or'} else {{1}})",
        f"(({pick % '||'}) ? {{0}} : {{1}})",
        lambda ir, a, b: ir.select(
            ir.logic("or", ir.compare(predicate, a, b), ir.compare("uno", a, a)), a, b),
        lambda f, y, a, b: (f.where(f.eq(y, a), 1.0, 0.0), f.where(f.eq(y, a), 0.0, 1.0)),
        tangent=lambda f, y, operands, tangents: f.where(f.eq(y, operands[0]), *tangents),
        array=f"{name}({{0}}, {{1}})")


OPERATIONS = {operation.name: operation for operation in (
    _infix("add", "+", np.add, "fadd", lambda f, y, a, b: (1.0, 1.0)),
    _infix("sub", "-", np.subtract, "fsub", lambda f, y, a, b: (1.0, -1.0)),
    _infix("mul", "*", np.multiply, "fmul", lambda f, y, a, b: (b, a)),
    _infix("div", "/", np.true_divide, "fdiv",
           lambda f, y, a, b: (f.div(1.0, b), f.neg(f.div(y, b)))),
    Operation("neg", 1, np.negative, "-{0}", "-{0}", lambda ir, a: ir.negate(a),
              lambda f, y, a: (-1.0,)),
    _intrinsic("abs", np.absolute, lambda f, y, a: (f.sign(a),), c="fabs"),
    _intrinsic("sqrt", np.sqrt, lambda f, y, a: (f.div(0.5, y),)),
    _intrinsic("floor", np.floor, _flat),
    _intrinsic("ceil", np.ceil, _flat),
    _intrinsic("trunc", np.trunc, _flat),
    _intrinsic("rint", np.rint, _flat),
    Operation("sign", 1, np.sign,
              "(one if {0} > 0 else -one if {0} < 0 else zero if {0} == 0 else {0})",
              "({0} > 0 ? 1.0 : {0} < 0 ? -1.0 : {0} == 0 ? 0.0 : {0})", _sign_llvm, _flat,
              array="sign({0})"),
    Operation("sin", 1, np.sin, "sin({0})", "sin({0})", lambda ir, a: ir.sine(a),
              lambda f, y, a: (f.cos(a),)),
    Operation("cos", 1, np.cos, "cos({0})", "cos({0})", lambda ir, a: ir.cosine(a),
              lambda f, y, a: (f.neg(f.sin(a)),)),
    _libm("tan", np.tan, lambda f, y, a: (f.add(1.0, f.mul(y, y)),)),
    _libm("arcsin", np.arcsin, lambda f, y, a: (_rsqrt(f, f.sub(1.0, f.mul(a, a))),), c="asin"),
    _libm("arccos", np.arccos,
          lambda f, y, a: (f.neg(_rsqrt(f, f.sub(1.0, f.mul(a, a)))),), c="acos"),
    _libm("arctan", np.arctan,
          lambda f, y, a: (f.div(1.0, f.add(1.0, f.mul(a, a))),), c="atan"),
    _libm("sinh", np.sinh, lambda f, y, a: (f.cosh(a),)),
    _libm("cosh", np.cosh, lambda f, y, a: (f.sinh(a),)),
    _libm("tanh", np.tanh, lambda f, y, a: (f.sub(1.0, f.mul(y, y)),)),
    _libm("arcsinh", np.arcsinh, lambda f, y, a: (_rsqrt(f, f.add(f.mul(a, a), 1.0)),),
          c="asinh"),
    _libm("arccosh", np.arccosh, lambda f, y, a: (_rsqrt(f, f.sub(f.mul(a, a), 1.0)),),
          c="acosh"),
    _libm("arctanh", np.arctanh,
          lambda f, y, a: (f.div(1.0, f.sub(1.0, f.mul(a, a))),), c="atanh"),
    _libm("exp", np.exp, lambda f, y, a: (y,)),
    _libm("expm1", np.expm1, lambda f, y, a: (f.add(y, 1.0),)),
    _libm("log", np.log, lambda f, y, a: (f.div(1.0, a),)),
    _libm("log1p", np.log1p, lambda f, y, a: (f.div(1.0, f.add(1.0, a)),)),
    _libm("log2", np.log2, lambda f, y, a: (f.div(1.0 / np.log(2.0), a),)),
    _libm("log10", np.log10, lambda f, y, a: (f.div(1.0 / np.log(10.0), a),)),
    _libm("cbrt", np.cbrt, lambda f, y, a: (f.div(y, f.mul(3.0, a)),)),
    _libm("pow", np.power, lambda f, y, a, b: (
        f.mul(b, f.pow(a, f.sub(b, 1.0))),
        f.where(f.gt(a, 0.0), f.mul(y, f.log(f.where(f.gt(a, 0.0), a, 1.0))), 0.0)), arity=2),
    _libm("arctan2", np.arctan2, lambda f, y, a, b: _arctan2_partials(f, a, b), arity=2,
          c="atan2"),
    _libm("hypot", np.hypot, lambda f, y, a, b: (f.div(a, y), f.div(b, y)), arity=2),
    _libm("fmod", np.fmod, lambda f, y, a, b: (1.0, f.neg(f.trunc(f.div(a, b)))), arity=2),
    Operation("copysign", 2, np.copysign, "copysign({0}, {1})", "copysign({0}, {1})",
              lambda ir, a, b: ir.intrinsic("copysign", a, b),
              lambda f, y, a, b: (f.mul(f.copysign(1.0, a), f.copysign(1.0, b)), 0.0)),
    _extremum("maximum", np.maximum, ">=", "oge"),
    _extremum("minimum", np.minimum, "<=", "ole"),
    _compare("lt", "<", np.less, "olt"),
    _compare("le", "<=", np.less_equal, "ole"),
    _compare("gt", ">", np.greater, "ogt"),
    _compare("ge", ">=", np.greater_equal, "oge"),
    _compare("eq", "==", np.equal, "oeq"),
    _compare("ne", "!=", np.not_equal, "une"),
    Operation("and", 2, np.logical_and, "({0} and {1})", "({0} && {1})",
              lambda ir, a, b: ir.logic("and", a, b), _flat, boolean=True,
              array="logical_and({0}, {1})"),
    Operation("or", 2, np.logical_or, "({0} or {1})", "({0} || {1})",
              lambda ir, a, b: ir.logic("or", a, b), _flat, boolean=True,
              array="logical_or({0}, {1})"),
    Operation("not", 1, np.logical_not, "(not {0})", "(!{0})",
              lambda ir, a: ir.invert(a), _flat, boolean=True, array="logical_not({0})"),
    Operation("where", 3, np.where, "({1} if {0} else {2})", "({0} ? {1} : {2})",
              lambda ir, c, a, b: ir.select(c, a, b),
              lambda f, y, c, a, b: (0.0, f.where(c, 1.0, 0.0), f.where(c, 0.0, 1.0)),
              tangent=lambda f, y, operands, tangents: f.where(operands[0], *tangents[1:]),
              array="where({0}, {1}, {2})"),
)}


def _rsqrt(f: Any, a: Any) -> Any:
    return f.div(1.0, f.sqrt(a))


def _arctan2_partials(f: Any, a: Any, b: Any) -> tuple:
    square = f.add(f.mul(a, a), f.mul(b, b))
    return f.div(b, square), f.neg(f.div(a, square))


class _CallText(str):
    """Python text of a call, whatever the number of its operands."""

    def format(self, *operands: object, **named: object) -> str:
        return f"{str(self)}({', '.join(map(str, operands))})"


class _NoText(str):
    def format(self, *operands: object, **named: object) -> NoReturn:
        raise ClieError("an opaque block, or one in C, has no source in C; write it with "
                        "numpy functions that can be traced")


def _refuse(*operands: Any) -> NoReturn:
    raise ClieError("an opaque block, or one in C, has no derivative; take central differences "
                    "of batch() with the parameter a little up and down")


def _foreign(number: float, size: float, *operands: float) -> np.ndarray:
    return foreign_function(number)(operands)


CALLBACKS = {operation.name: operation for operation in (
    Operation("call", 0, _refuse, _CallText("opaque"), _NoText(),
              lambda ir, index, size, *operands: ir.call_back(index, int(size), operands),
              _refuse),
    Operation("foreign", 0, _foreign, _CallText("foreign"), _NoText(),
              lambda ir, number, size, *operands: ir.foreign(number, int(size), operands),
              _refuse),
    Operation("pick", 2, lambda values, k: values[int(k)], "{0}[int({1})]", _NoText(),
              lambda ir, values, k: values[int(k)], _refuse),
)}


def operation_named(name: str) -> Operation:
    """Return the operation of that name, of the table or of a callback."""
    return OPERATIONS[name] if name in OPERATIONS else CALLBACKS[name]
