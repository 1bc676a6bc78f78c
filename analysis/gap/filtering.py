"""Filters of signals and their responses, without scipy.signal, whose import takes half a second.

What the filters compute is what scipy's ``butter``, ``sosfiltfilt`` and ``freqz`` do.
"""

import numpy as np

from clie_blocks.compiled.recursion import lfilter


def high_passed(x, order, corner, rate):
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


def response(b, a, frequency):
    """Complex response of a filter at frequencies [rad per sample]."""
    back = np.exp(-1j * np.asarray(frequency))
    return np.polyval(b[::-1], back) / np.polyval(a[::-1], back)
