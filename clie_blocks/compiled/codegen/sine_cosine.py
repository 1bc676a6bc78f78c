"""Sine and cosine of several lanes in line, both from one reduction of the angle.

The angle is brought within pi/4 of a multiple of pi/2, in three parts of pi/2 (Cody and Waite,
*Software Manual for the Elementary Functions*, 1980) with fused multiplications; there a
polynomial of least greatest error follows each function to 2e-18, before rounding.  Against the
two calls of the C library nothing has to leave the registers.  Results are off by less than 1.5
units in the last place; angles beyond `LIMIT` go to the C library.  Infinities and NaN stay in
line and give NaN, so that a run that has diverged does not hold up those beside it.
"""

import math

from clie_blocks.compiled.codegen.builder import Builder, Operand, Value
from clie_blocks.compiled.codegen.vector_math import has_fused_multiplication

LIMIT = 2.0**20  # rad, below which three parts of pi/2 are exact enough
_ROUND = 1.5 * 2.0**52  # added, it leaves the nearest whole number in the last bits
_PI_HALF = (float.fromhex("0x1.921fb54442d18p+0"), float.fromhex("0x1.1a62633145c07p-54"),
            float.fromhex("-0x1.f1976b7ed8fbcp-110"))
_SINE = tuple(map(float.fromhex, (  # of (sin r / r - 1) / z, with z = r^2
    "-0x1.5555555555549p-3", "0x1.111111110f87ap-7", "-0x1.a01a019c11996p-13",
    "0x1.71de3577b69c0p-19", "-0x1.ae5e663a8ea59p-26", "0x1.5d9300fb26d44p-33")))
_COSINE = tuple(map(float.fromhex, (  # of (cos r - 1 + z / 2) / z^2
    "0x1.555555555554cp-5", "-0x1.6c16c16c1517ep-10", "0x1.a01a019cb1bd7p-16",
    "-0x1.27e4f809f0685p-22", "0x1.1ee9ebe9048f5p-29", "-0x1.8fae9c60e5a7bp-37")))
_TEXT = """\
define internal {{{kind}, {kind}}} @{name}({kind} %x) alwaysinline nounwind {{
{range}
  %near = call i1 @llvm.vector.reduce.and.v{width}i1(<{width} x i1> {inside})
  br i1 %near, label %in.line, label %far, !prof !0
in.line:
{inline}
  br label %done
far:
{library}
  br label %done
done:
  %sine = phi {kind} [ {sine}, %in.line ], [ {far_sine}, %far ]
  %cosine = phi {kind} [ {cosine}, %in.line ], [ {far_cosine}, %far ]
  %one = insertvalue {{{kind}, {kind}}} poison, {kind} %sine, 0
  %both = insertvalue {{{kind}, {kind}}} %one, {kind} %cosine, 1
  ret {{{kind}, {kind}}} %both
}}
!0 = !{{!"branch_weights", i32 10000, i32 1}}
"""


def is_in_line(width: int) -> bool:
    """Return whether so many lanes compute sines in line on this processor."""
    return width > 1 and has_fused_multiplication()


class LaneBuilder(Builder):
    """A `Builder` whose sines and cosines of several lanes are in line.

    Parameters
    ----------
    width : int
        Number of lanes.

    """

    def __init__(self, width: int = 1) -> None:
        super().__init__(width)
        self._both: dict[str, str] = {}

    def sine(self, a: Operand) -> Value:
        """Write a sine; that of several lanes comes with the cosine."""
        return self._of_angle(0, a) or super().sine(a)

    def cosine(self, a: Operand) -> Value:
        """Write a cosine; that of several lanes comes with the sine."""
        return self._of_angle(1, a) or super().cosine(a)

    def _of_angle(self, entry: int, a: Operand) -> Value | None:
        if not (isinstance(a, Value) and a.varying and is_in_line(self.width)):
            return None
        kind = self.type(True)
        if a.name not in self._both:
            inner = Builder(self.width)
            function, text = _definition(inner, Value("%x", True))
            self.declarations |= inner.declarations | {text}
            self._both[a.name] = self.put(
                f"call {{{kind}, {kind}}} @{function}({kind} {a.name})")
        return Value(self.put(f"extractvalue {{{kind}, {kind}}} {self._both[a.name]}, {entry}"),
                     True)


def _definition(ir: Builder, x: Value) -> tuple[str, str]:
    """Return the name and the text of a function of x, the register ``%x``, for all lanes of `ir`.

    It returns sine and cosine, and is copied into the functions that call it.
    """
    name = f"sine_and_cosine.{ir.width}"
    size = ir.intrinsic("fabs", x)
    inside = ir.logic("or", ir.compare("ule", size, LIMIT), ir.compare("oeq", size, math.inf))
    begin = len(ir.lines)
    sine, cosine = _in_line(ir, x)
    end = len(ir.lines)
    far_sine, far_cosine = ir.libm("sin", x), ir.libm("cos", x)
    ir.declarations.add(
        f"declare i1 @llvm.vector.reduce.and.v{ir.width}i1(<{ir.width} x i1>)")
    return name, _TEXT.format(
        name=name, kind=ir.type(True), width=ir.width, inside=inside.name,
        range="\n".join(ir.lines[:begin]), inline="\n".join(ir.lines[begin:end]),
        library="\n".join(ir.lines[end:]), sine=sine.name, cosine=cosine.name,
        far_sine=far_sine.name, far_cosine=far_cosine.name)


def _in_line(ir: Builder, x: Value) -> tuple[Value, Value]:
    shifted = ir.intrinsic("fma", x, 1.0 / _PI_HALF[0], _ROUND)
    quarter_turns = ir.negate(ir.arithmetic("fsub", shifted, _ROUND))
    r = x
    for part in _PI_HALF:
        r = ir.intrinsic("fma", quarter_turns, part, r)
    z = ir.arithmetic("fmul", r, r)
    square = ir.arithmetic("fmul", z, z)
    sine = ir.intrinsic("fma", ir.arithmetic("fmul", r, z), _polynomial(ir, _SINE, z, square), r)
    half = ir.arithmetic("fmul", z, 0.5)
    near_one = ir.arithmetic("fsub", 1.0, half)
    lost = ir.arithmetic("fsub", ir.arithmetic("fsub", 1.0, near_one), half)
    cosine = ir.arithmetic("fadd", near_one, ir.intrinsic(
        "fma", square, _polynomial(ir, _COSINE, z, square), lost))
    odd, over, under = (_bit(ir, shifted, *bits) for bits in ((0, 1), (0, 2), (1, 2)))
    whole = _signed(ir, over, ir.select(odd, cosine, sine))
    return (ir.select(ir.compare("oeq", x, 0.0), x, whole),  # which keeps the sign of zero
            _signed(ir, under, ir.select(odd, sine, cosine)))


def _polynomial(ir: Builder, coefficients: tuple[float, ...], z: Value, square: Value) -> Value:
    """Write a polynomial in z as one in its square, whose pairs do not wait for one another."""
    pairs = [ir.intrinsic("fma", z, high, low)
             for low, high in zip(coefficients[::2], coefficients[1::2])]
    value = pairs.pop()
    while pairs:
        value = ir.intrinsic("fma", value, square, pairs.pop())
    return value


def _bit(ir: Builder, shifted: Value, add: int, mask: int) -> Value:
    """Write whether a bit of the whole number of quarter turns, plus some, is set."""
    kind = ir.type(True, "i64")

    def every(number: int) -> str:
        return f"<{', '.join([f'i64 {number}'] * ir.width)}>"

    bits = ir.put(f"bitcast {ir.type(True)} {shifted.name} to {kind}")
    turned = ir.put(f"add {kind} {bits}, {every(add)}")
    kept = ir.put(f"and {kind} {turned}, {every(mask)}")
    return shifted._replace(name=ir.put(f"icmp ne {kind} {kept}, zeroinitializer"),
                            boolean=True)


def _signed(ir: Builder, negative: Value, value: Value) -> Value:
    return ir.select(negative, ir.negate(value), value)
