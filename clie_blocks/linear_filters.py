"""Linear filters in discrete time: recursion, Butterworth filters, zero phase, response, hold.

They return what scipy.signal returns, to round-off, without importing it: its import takes 0.5 s
and more, a tenth of a diagnosis.  `lfilter` runs as machine code.
"""

import ctypes
import functools
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError

WIDEST = 8  # columns that the recursion filters side by side
DISCRETISATIONS = ("tustin", "zoh", "backward", "forward", "matched")  # of G1 (47)
CORNERS = ("highpass", "lowpass")  # of G1 (47), as keys of parameters
TERMS = 20  # of the exponential series; at a norm of 1/2 the next is below 1e-24

Section = tuple[np.ndarray, np.ndarray]  # numerator and denominator in powers of 1/z
Band = Literal["low", "high"]  # what passes


def lfilter(b: ArrayLike, a: ArrayLike, x: ArrayLike) -> np.ndarray:
    """Filter a signal, or every column of a table, from rest along the first axis.

    Parameters
    ----------
    b, a : array_like, shape (m,)
        Numerator and denominator in powers of 1/z.
    x : array_like, shape (N, ...)
        Signals.

    Returns
    -------
    ndarray, shape (N, ...)
        y with a[0] y[i] = b[0] x[i] + b[1] x[i-1] + ... - a[1] y[i-1] - ...

    """
    b, a, x = np.asarray(b), np.asarray(a), np.asarray(x, float)
    coefficients = np.zeros((2, max(len(a), len(b))))
    coefficients[0, :len(b)], coefficients[1, :len(a)] = b / a[0], a / a[0]
    count = x[:1].size
    width = 1 if count < 2 else min(WIDEST, 1 << (count - 1).bit_length())
    run = _recursion(coefficients.shape[1] - 1, width)
    if run is None:
        from scipy.signal import lfilter as slow
        return slow(*coefficients, x, axis=0)
    padded = np.zeros((len(x), -(-count // width) * width))
    padded[:, :count] = x.reshape(len(x), count)
    result = np.empty_like(padded)
    for first in range(0, padded.shape[1], width):
        run(len(x), padded.shape[1], coefficients.ctypes.data, padded[:, first:].ctypes.data,
            result[:, first:].ctypes.data)
    return result[:, :count].reshape(x.shape)


def high_pass(x: np.ndarray, order: int, corner: float, rate: float) -> np.ndarray:
    """Signals above a corner, without a shift in time, along the first axis.

    Parameters
    ----------
    x : ndarray, shape (N, ...)
        Signals.
    order : int
        Order of the Butterworth filter, even; it runs forward and back.
    corner, rate : float
        Corner and sampling rate [Hz].

    """
    return zero_phase(butterworth(order, corner, rate, "high"), x)


def low_pass(x: np.ndarray, order: int, corner: float, rate: float) -> np.ndarray:
    """Signals below a corner, without a shift in time, along the first axis.

    Parameters
    ----------
    x : ndarray, shape (N, ...)
        Signals.
    order : int
        Order of the Butterworth filter, even; it runs forward and back.
    corner, rate : float
        Corner and sampling rate [Hz].

    """
    return zero_phase(butterworth(order, corner, rate, "low"), x)


def butterworth(order: int, corner: float, rate: float, band: Band) -> list[Section]:
    """Butterworth filter as sections of second order; the corner is exact.

    Parameters
    ----------
    order : int
        Even.
    corner, rate : float
        Corner and sampling rate [Hz].
    band : {'low', 'high'}
        What passes, with gain one at frequency zero or at half the sampling rate.

    Returns
    -------
    list of (ndarray, ndarray)
        Numerator and denominator of every section, shape (3,) each, best damped poles first.

    """
    zero = 1.0 if band == "low" else -1.0  # both zeros lie at z = -zero
    upper_half = np.exp(1j * np.pi * (2 * np.arange(order // 2) + order + 1) / (2 * order))
    analog = np.tan(np.pi * corner / rate) * upper_half**zero
    poles = (1.0 + analog) / (1.0 - analog)
    sections = []
    for pole in poles[np.argsort(np.abs(poles))]:
        b = np.array([1.0, 2.0 * zero, 1.0])
        a = np.array([1.0, -2.0 * pole.real, abs(pole)**2])
        sections.append((b * (a @ [1.0, zero, 1.0] / 4.0), a))
    return sections


def zero_phase(sections: Sequence[Section], x: np.ndarray) -> np.ndarray:
    """Signals filtered forward and back along the first axis, as by ``scipy.signal.sosfiltfilt``.

    Both runs start from the steady state of their first sample, on the signal extended at both
    ends by its reflection through the end point.

    Parameters
    ----------
    sections : sequence of (ndarray, ndarray)
        Numerator and denominator of every section, of second order.
    x : ndarray, shape (N, ...)
        Signals.

    Raises
    ------
    ClieError
        For a signal that is not longer than what is added at its ends.

    """
    edge = 3 * (2 * len(sections) + 1)
    if len(x) <= edge:
        raise ClieError(f"a signal of {len(x)} samples is too short to be filtered forward and "
                        f"back at order {2 * len(sections)}; it needs more than {edge}")
    gain = np.prod([b.sum() / a.sum() for b, a in sections])
    y = np.concatenate([2 * x[0] - x[edge:0:-1], x, 2 * x[-1] - x[-2:-edge - 2:-1]])
    for _ in range(2):
        start, y = y[0], y - y[0]  # the steady state by superposition: the rest is from rest
        for b, a in sections:
            y = lfilter(b, a, y)
        y = (y + gain * start)[::-1]
    return y[edge:-edge]


def frequency_response(b: ArrayLike, a: ArrayLike, frequency: ArrayLike) -> np.ndarray:
    """Complex response of a filter.

    Parameters
    ----------
    b, a : array_like, shape (m,)
        Numerator and denominator in powers of 1/z.
    frequency : array_like
        Frequencies [rad per sample].

    """
    delay = np.exp(-1j * np.asarray(frequency))
    return np.polyval(np.asarray(b)[::-1], delay) / np.polyval(np.asarray(a)[::-1], delay)


def zero_order_hold(a: ArrayLike, b: ArrayLike, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Matrices of ``x[i+1] = A x[i] + B u[i]`` for dx/dt = a x + b u under a held input.

    Parameters
    ----------
    a : array_like, shape (n, n)
        State matrix [1/s].
    b : array_like, shape (n, m)
        Input matrix.
    step : float
        Sample time [s].

    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    states, inputs = b.shape
    joint = np.zeros((states + inputs, states + inputs))
    joint[:states] = step * np.hstack([a, b])
    exponential = _exponential(joint)
    return exponential[:states, :states], exponential[:states, states:]


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """Matrix exponential: a power series, halved until it converges and squared again."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.linalg.norm(matrix)), 1e-300)))) + 1)
    scaled = matrix / 2.0**halvings
    result = term = np.eye(len(matrix))
    for k in range(1, TERMS):
        term = term @ scaled / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result


@functools.cache
def _recursion(order: int, width: int) -> Callable[..., Any] | None:
    """Machine code for filters of an order, so many columns side by side; None without LLVM."""
    try:
        from clie_blocks.compiled.codegen.machine import Machine
    except ImportError:
        return None
    machine = Machine(_text(order, width), ["filter"])
    count, array = ctypes.c_int64, ctypes.c_void_p
    function: Any = machine.function("filter", count, count, array, array, array)
    function.machine = machine  # the code lives as long as its machine
    return function


def _text(order: int, width: int) -> str:
    """LLVM module of the transposed direct form, whose memory stays in registers."""
    kind = f"<{width} x double>" if width > 1 else "double"
    delays = range(order + 1)
    head = [line for row, part in enumerate("ba") for k in delays
            for line in _load(f"{part}{k}", row * (order + 1) + k, width, kind)]
    memory = [f"%z{k} = phi {kind} [{'zeroinitializer' if width > 1 else '0.0'}, %begin], "
              f"[%next{k}, %loop]" for k in range(order)]
    body = [f"%{'y0' if order else 'y1'} = fmul {kind} %b0, %x0",
            *([f"%y1 = fadd {kind} %y0, %z0"] if order else []),
            f"store {kind} %y1, ptr %target, align 8"]
    for k in range(order):
        last = k == order - 1
        body += [f"%driven{k} = fmul {kind} %b{k + 1}, %x0",
                 *([] if last else [f"%moved{k} = fadd {kind} %z{k + 1}, %driven{k}"]),
                 f"%fed{k} = fmul {kind} %a{k + 1}, %y1",
                 f"%next{k} = fsub {kind} %{'driven' if last else 'moved'}{k}, %fed{k}"]
    return MODULE.format(head="\n  ".join(head), memory="\n  ".join(memory),
                         body="\n  ".join(body), kind=kind)


def _load(name: str, offset: int, width: int, kind: str) -> list[str]:
    """Lines that load a coefficient, the same for all columns."""
    one = f"%{name}" if width == 1 else f"%{name}.one"
    lines = [f"%{name}.at = getelementptr double, ptr %numbers, i64 {offset}",
             f"{one} = load double, ptr %{name}.at, align 8"]
    if width > 1:
        lines += [f"%{name}.in = insertelement {kind} poison, double {one}, i32 0",
                  f"%{name} = shufflevector {kind} %{name}.in, {kind} poison, "
                  f"<{width} x i32> zeroinitializer"]
    return lines


MODULE = """\
define void @filter(i64 %n, i64 %stride, ptr %numbers, ptr noalias %x, ptr noalias %y) {{
begin:
  {head}
  %some = icmp sgt i64 %n, 0
  br i1 %some, label %loop, label %end
loop:
  %i = phi i64 [0, %begin], [%after, %loop]
  {memory}
  %at = mul i64 %i, %stride
  %source = getelementptr double, ptr %x, i64 %at
  %target = getelementptr double, ptr %y, i64 %at
  %x0 = load {kind}, ptr %source, align 8
  {body}
  %after = add i64 %i, 1
  %more = icmp slt i64 %after, %n
  br i1 %more, label %loop, label %end
end:
  ret void
}}
"""


def discrete_pole(kind: str, step: float, corner: np.ndarray | float) -> Any:
    """Pole of a first-order lag with a corner [rad/s], as a discretisation maps it."""
    a = corner * step
    return {"tustin": lambda: (2 - a) / (2 + a), "zoh": lambda: np.exp(-a),
            "matched": lambda: np.exp(-a), "backward": lambda: 1 / (1 + a),
            "forward": lambda: 1 - a}[kind]()


def two_corner_filter(kind: str, step: float, high: np.ndarray | float,
                      low: np.ndarray | float) -> tuple[list[Any], list[Any]]:
    """Coefficients ``b, a`` of G1 (47) in powers of 1/z, one value per corner or an array of them.

    Parameters
    ----------
    kind : str
        One of `DISCRETISATIONS`.  ``zoh`` keeps the step response of G1, and with it the slope of
        a ramp only nearly; ``matched`` maps the poles alike and has the zero of the backward
        difference.
    step : float
        Sample time [s].
    high, low : float or ndarray
        High-pass and low-pass corner [rad/s].

    """
    p1, p2 = (discrete_pole(kind, step, corner) for corner in (high, low))
    gain = (1 - p1) * (1 - p2) / step
    if kind == "zoh":
        apart = np.abs(low - high) * step
        spread = np.where(apart > 0, -np.expm1(-apart) / np.where(apart > 0, apart, 1.0), 1.0)
        gain = high * low * step * np.maximum(p1, p2) * spread
    now, before = {"tustin": (0.5, 0.5), "backward": (1.0, 0.0), "matched": (1.0, 0.0)}.get(
        kind, (0.0, 1.0))
    return ([now * gain, (before - now) * gain, -before * gain],
            [1.0 + 0.0 * p1, -(p1 + p2), p1 * p2])
