"""What a block looks like: its formula, its sign or its characteristic.

A block may say so itself: ``block.icon = ("curve", f)`` with f on [-1, 1], ``("curve", (x, y))``
with the points of a path such as a hysteresis loop, or ``("text", "$1/s$")``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.labels import ports

if TYPE_CHECKING:
    import control as ct

SPANS = np.logspace(-4, 4, 17)


@dataclass(frozen=True)
class Icon:
    """A kind, ``'sum'``, ``'gain'``, ``'text'`` or ``'curve'``, and what it shows."""

    kind: str
    content: Any


def icon_of(system: ct.NonlinearIOSystem, inputs: Sequence[str],
            outputs: Sequence[str]) -> tuple[Icon | None, tuple[str, ...]]:
    """Icon of a block and, for a sum, the sign of each input port as it is drawn.

    There is none for a block that is best drawn by its name.
    """
    import control as ct

    declared = getattr(system, "icon", None)
    if declared is not None:
        return _declared(*declared), ()
    whole = len(outputs) == 1 and list(outputs) == list(ports(system.output_labels))
    if not whole or list(inputs) != list(ports(system.input_labels)):
        return None, ()
    if isinstance(system, ct.StateSpace):
        signs = _signs(system)
        if signs and len(signs) > 1:
            return Icon("sum", ""), signs
        return _linear_icon(system), ()
    return _curve_icon(system, inputs), ()


def _declared(kind: str, content: Any) -> Icon:
    if kind == "curve" and callable(content):
        x = np.linspace(-1.0, 1.0, 121)
        content = (x, np.array([float(content(value)) for value in x]))
    return Icon(kind, content)


def _signs(system: ct.StateSpace) -> tuple[str, ...]:
    """Signs of a static block that adds and subtracts whole vectors, else nothing."""
    groups = list(ports(system.input_labels).values())
    if system.nstates or any(len(group) != system.noutputs for group in groups):
        return ()
    parts = [system.D[:, group] for group in groups]
    eye = np.eye(system.noutputs)
    if not all(np.array_equal(abs(part), eye) and abs(part.sum()) == len(eye) for part in parts):
        return ()
    return tuple("+" if part[0, 0] > 0 else "\u2212" for part in parts)


def _linear_icon(system: ct.StateSpace) -> Icon | None:
    """Formula of a linear block that treats every channel alike."""
    if system.ninputs != system.noutputs:
        return Icon("gain", "$K$") if not system.nstates else None
    points = (1j * np.array([0.31, 7.3, 190.0]) if not system.isdtime(strict=True)
              else np.exp(1j * np.array([0.1, 0.7, 2.1])))
    gains = np.array([np.atleast_2d(system(point)) for point in points])
    alike = all(np.allclose(gain, gain[0, 0] * np.eye(len(gain)), rtol=1e-9, atol=1e-12)
                for gain in gains)
    if not system.nstates:
        return Icon("gain", f"${system.D[0, 0]:.4g}$" if alike else "$K$")
    return Icon("text", _formula(system)) if alike else None


def _formula(system: ct.StateSpace) -> str:
    """Transfer function of the first channel as mathtext."""
    import control as ct

    channel = ct.ss(system.A, system.B[:, :1], system.C[:1], system.D[:1, :1], system.dt)
    zeros, poles = _cancel(list(ct.zeros(channel)), list(ct.poles(channel)))
    s = "z" if system.isdtime(strict=True) else "s"
    point = 1.7j + 0.9
    shape = np.prod(point - np.array(zeros)) / np.prod(point - np.array(poles))
    gain = float(np.real(complex(channel(point)) / shape))
    if s == "s" and _unit_sections(gain, zeros, poles):
        tops = [f"{_number(-p.real)}\\,s" if k < len(zeros) else _number(-p.real)
                for k, p in enumerate(poles)]
        return "$" + r"\cdot".join(rf"\frac{{{top}}}{{{_factor(p, s)}}}"
                                   for top, p in zip(tops, poles)) + "$"
    top = _product(gain, zeros, s)
    return rf"$\frac{{{top}}}{{{_product(1.0, poles, s)}}}$" if poles else f"${top}$"


def _cancel(zeros: list, poles: list) -> tuple[list, list]:
    zeros = [z for z in zeros if np.isfinite(z)]
    for z in list(zeros):
        close = [p for p in poles if abs(p - z) < 1e-6 * max(1.0, abs(z))]
        if close:
            zeros.remove(z)
            poles.remove(close[0])
    return zeros, sorted(poles, key=lambda p: (abs(p), p.imag))


def _unit_sections(gain: float, zeros: Sequence[complex], poles: Sequence[complex]) -> bool:
    """Whether it is a chain of ``p/(s + p)`` and ``p s/(s + p)``, as filters are written."""
    p = np.array(poles)
    return bool(0 < len(p) <= 3 and len(zeros) <= len(p) and np.allclose(zeros, 0, atol=1e-9)
                and np.all(p.real < 0) and np.allclose(p.imag, 0)
                and np.isclose(gain, np.prod(-p.real), rtol=1e-6))


def _product(gain: float, roots: Sequence[complex], s: str) -> str:
    """Product of factors, complex ones and long ones multiplied out."""
    if len(roots) and np.any(abs(np.imag(roots)) > 1e-9):
        return _polynomial(gain * np.real(np.poly(roots)), s)
    factors = [_factor(root, s) for root in roots]
    text = "".join(f"({factor})" if factor != s and len(factors) > 1 else factor
                   for factor in factors)
    number = _number(gain)
    if not text:
        return number
    if number in ("1", "-1"):
        return number.rstrip("1") + text
    return f"{number}\\,({text})" if len(factors) == 1 and text != s else f"{number}\\,{text}"


def _polynomial(coefficients: np.ndarray, s: str) -> str:
    terms = ""
    for power, value in zip(range(len(coefficients) - 1, -1, -1), coefficients):
        if abs(value) < 1e-12:
            continue
        number = _number(abs(value))
        body = {0: "", 1: s}.get(power, f"{s}^{power}")
        number = "" if number == "1" and body else number
        terms += ("-" if value < 0 else "+") + number + body
    return terms.lstrip("+") or "0"


def _factor(root: complex, s: str) -> str:
    value = float(np.real(root))
    if abs(value) < 1e-9:
        return s
    return f"{s}{'-' if value > 0 else '+'}{_number(abs(value))}"


def _number(value: float) -> str:
    text = f"{value:.4g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    power = rf"10^{{{int(exponent)}}}"
    return power if mantissa == "1" else rf"{mantissa}\cdot {power}"


def _curve_icon(system: ct.NonlinearIOSystem, inputs: Sequence[str]) -> Icon | None:
    """Characteristic of a nonlinear static block with one input, found by trying it."""
    if system.nstates or len(inputs) != 1 or system.ninputs != system.noutputs:
        return None
    try:
        curves = [_characteristic(system, np.linspace(-span, span, 41)) for span in SPANS]
        bends = [_nonlinearity(*curve) for curve in curves]
        if max(bends) < 0.02:
            return None
        best = next(k for k, bend in enumerate(bends) if bend > 0.6 * max(bends))
        span = SPANS[best]
        return Icon("curve", _characteristic(system, np.linspace(-span, span, 121)))
    except (ArithmeticError, ValueError, TypeError, IndexError, KeyError):
        return None  # a block that cannot be tried alone is drawn by its name


def _characteristic(system: ct.NonlinearIOSystem, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows = np.zeros((len(x), system.ninputs))
    rows[:, 0] = x
    y = [np.ravel(system.output(0.0, np.zeros(0), row))[0] for row in rows]
    return x, np.array(y, float)


def _nonlinearity(x: np.ndarray, y: np.ndarray) -> float:
    """Distance of a curve from its best line, relative to its height; -1 if not finite."""
    if not np.all(np.isfinite(y)) or np.ptp(y) == 0:
        return -1.0
    line = np.polyval(np.polyfit(x, y, 1), x)
    return float(np.sqrt(np.mean((y - line) ** 2)) / np.ptp(y))
