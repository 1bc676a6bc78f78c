"""Velocity filters of sampled controllers, from position to velocity, as coefficients.

F(z) = (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)
"""

import numpy as np

from clie_blocks.errors import RecordError
from clie_blocks.linear_filters import (
    DISCRETISATIONS,
    discrete_pole,
    lfilter,
    two_corner_filter,
)

NEVER_FORGETS = 1 - 1e-4  # pole whose response outlasts 400,000 samples
SETTLED = 1e-4  # share of its start that a velocity filter has forgotten when it counts as settled


def velocity_filter(kind: str, step: float,
                    corners: tuple[float, float] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients ``b, a`` of a velocity filter, each of shape (3,).

    Parameters
    ----------
    kind : str
        G1 (47) as ``tustin``, ``zoh``, ``backward``, ``forward`` or ``matched`` makes it;
        ``two_tap``, ``(q_k - q_{k-2}) / (2 T)``; ``difference``, ``(q_k - q_{k-1}) / T``;
        ``none``.
    step : float
        Sample time [s].
    corners : tuple of float
        High-pass and low-pass corner of G1 [rad/s].

    """
    if kind not in DISCRETISATIONS:
        taps = {"two_tap": [0.5, 0.0, -0.5], "difference": [1.0, -1.0, 0.0]}.get(kind, [0.0] * 3)
        return np.array(taps) / step, np.array([1.0, 0.0, 0.0])
    b, a = two_corner_filter(kind, step, *_known_corners(kind, corners))
    return np.array(b, float), np.array(a, float)


def discretisations(step: float, corners: tuple[float, float]) -> tuple[str, ...]:
    """Names of the discretisations of G1 that are stable, and no more than just, at a step."""
    return tuple(name for name in DISCRETISATIONS
                 if max(abs(discrete_pole(name, step, corner)) for corner in corners)
                 < NEVER_FORGETS)


def settling(denominator: np.ndarray) -> int:
    """Samples after which a filter of these coefficients `a` no longer knows how its run began.

    One that never forgets, as a search for its corners may try, counts as one that hardly does.
    """
    slowest = max(np.abs(np.roots(denominator)), default=0.0)
    if slowest == 0.0:
        return 2
    return 2 + int(np.ceil(np.log(SETTLED) / np.log(np.clip(slowest, 1e-3, NEVER_FORGETS))))


def response_from_rest(b: np.ndarray, a: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Signals of shape (N, n) through a filter from rest, exact by a transform with zero padding.

    It starts at once, where a recursion has to be compiled first; a filter that hardly forgets,
    such as one whose corner is near the sample rate, is run as a recursion.
    """
    slowest = max(np.abs(np.roots(a)), default=0.0)
    if slowest > NEVER_FORGETS:
        return lfilter(b, a, x)
    forget = 40 / -np.log(max(slowest, 1e-9))
    size = 1 << int(np.ceil(np.log2(len(x) + forget)))
    delay = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size)
    response = np.polyval(b[::-1], delay) / np.polyval(a[::-1], delay)
    return np.fft.irfft(np.fft.rfft(x, size, axis=0) * response[:, None], size, axis=0)[:len(x)]


def _known_corners(kind: str, corners: tuple[float, float] | None) -> tuple[float, float]:
    if corners is None:
        raise RecordError(f"the velocity filter {kind!r} needs its two corners: state "
                          "velocity_filter_highpass_rad_s and velocity_filter_lowpass_rad_s")
    return corners
