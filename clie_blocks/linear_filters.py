"""Linear filters as machine code: what ``scipy.signal.lfilter`` computes, without its start-up.

Importing scipy.signal takes half a second, a tenth of a diagnosis.
"""

import ctypes
import functools

import numpy as np

WIDEST = 8  # columns side by side


def lfilter(b, a, x):
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
    numbers = np.zeros((2, max(len(a), len(b))))
    numbers[0, :len(b)], numbers[1, :len(a)] = np.asarray(b) / a[0], np.asarray(a) / a[0]
    x = np.asarray(x, float)
    count = x[:1].size
    width = 1 if count < 2 else min(WIDEST, 1 << (count - 1).bit_length())
    run = _kernel(numbers.shape[1] - 1, width)
    if run is None:
        from scipy.signal import lfilter as slow
        return slow(*numbers, x, axis=0)
    padded = np.zeros((len(x), -(-count // width) * width))
    padded[:, :count] = x.reshape(len(x), count)
    result = np.empty_like(padded)
    for first in range(0, padded.shape[1], width):
        run(len(x), padded.shape[1], numbers.ctypes.data, padded[:, first:].ctypes.data,
            result[:, first:].ctypes.data)
    return result[:, :count].reshape(x.shape)


@functools.cache
def _kernel(order, width):
    """Machine code for filters of an order, so many columns side by side, where there is LLVM."""
    try:
        from clie_blocks.compiled.codegen.machine import Machine
    except ImportError:
        return None
    machine = Machine(_text(order, width), ["filter"])
    count, array = ctypes.c_int64, ctypes.c_void_p
    function = machine.function("filter", count, count, array, array, array)
    function.machine = machine
    return function


def _text(order, width):
    """Module of the transposed direct form, whose memory lies in registers."""
    kind = f"<{width} x double>" if width > 1 else "double"
    places = range(order + 1)
    head = [line for row, part in enumerate("ba") for k in places
            for line in _number(f"{part}{k}", row * (order + 1) + k, width, kind)]
    kept = [f"%z{k} = phi {kind} [{'zeroinitializer' if width > 1 else '0.0'}, %begin], "
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
    return MODULE.format(head="\n  ".join(head), kept="\n  ".join(kept), body="\n  ".join(body),
                         kind=kind)


def _number(name, place, width, kind):
    """Lines that load a coefficient, the same for all columns."""
    one = f"%{name}" if width == 1 else f"%{name}.one"
    lines = [f"%{name}.at = getelementptr double, ptr %numbers, i64 {place}",
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
  {kept}
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


def high_pass(x, order, corner, rate):
    """Signals above a corner, without a shift in time, along the first axis.

    Butterworth's filter runs forward and back, over an odd extension of the signal at both ends.
    A constant gives nothing, so a run from rest on what differs from the first sample is a run
    from the steady state.

    Parameters
    ----------
    x : ndarray, shape (N, ...)
        Signals.
    order : int
        Order of the filter, even.
    corner, rate : float
        Corner and sampling rate [Hz].

    """
    b, a = butterworth(order, corner, rate)
    edge = 3 * (order + 1)
    extended = np.concatenate([2 * x[0] - x[edge:0:-1], x, 2 * x[-1] - x[-2:-edge - 2:-1]])
    for _ in range(2):
        extended = lfilter(b, a, extended - extended[0])[::-1]
    return extended[edge:-edge]


def butterworth(order, corner, rate):
    """Butterworth's high-pass filter, ``numerator, denominator``; the corner is exact."""
    angles = np.pi * (2 * np.arange(order) + order + 1) / (2 * order)
    analog = np.tan(np.pi * corner / rate) / np.exp(1j * angles)
    a = np.real(np.poly((1.0 + analog) / (1.0 - analog)))
    b, signs = np.poly(np.ones(order)), (-1.0) ** np.arange(order + 1)
    return b * (signs @ a) / (signs @ b), a


def frequency_response(b, a, frequency):
    """Complex response of a filter at frequencies [rad per sample]."""
    back = np.exp(-1j * np.asarray(frequency))
    return np.polyval(b[::-1], back) / np.polyval(a[::-1], back)
