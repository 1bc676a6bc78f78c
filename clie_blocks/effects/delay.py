"""Delays: in a continuous diagram a short memory of Legendre polynomials, sampled an exact line.

The memory holds the last `delay` seconds of a signal as `ORDER` coefficients z of the Legendre
polynomials over that window::

    delay z' = A z + B signal,    A_ij = -(2i + 1) (1 if i < j else (-1)^(i - j)),
    B_i = (2i + 1) (-1)^i

Read at the far end of the window it is the Pade approximant [5/6] of the delay, without
feedthrough.  It is right within 0.1 % until ``2 pi f delay = 5`` and within 0.5 % until 6; the
step of a run must be below delay/4.
"""

import control as ct
import numpy as np

from clie_blocks.signals import DiagramError, signals, vector

ORDER = 6
_ROW, _COLUMN = np.indices((ORDER, ORDER))
MEMORY = -(2 * _ROW + 1) * np.where(_ROW < _COLUMN, 1.0, (-1.0) ** (_ROW - _COLUMN))
ENTRY = (2 * np.arange(ORDER)[:, None] + 1) * (-1.0) ** np.arange(ORDER)[:, None]


def memory_rate(z, signal, delay):
    """Rate of the memory of a signal, z of shape (ORDER, n); without a delay it rests."""
    length = np.where(delay > 0, delay, 1.0)
    return np.where(delay > 0, (MEMORY @ z + ENTRY * signal) / length, 0.0)


def delayed(z, signal, delay):
    """Signal `delay` seconds ago; without a delay the signal itself, bit for bit."""
    return np.where(delay > 0, np.sum(z, axis=0), signal)


def recalled(z, signal, delay, share):
    """Signal ``share delay`` seconds ago, share in [0, 1]."""
    x = 2.0 * share - 1.0
    polynomials = [1.0, x]
    for k in range(1, ORDER - 1):
        polynomials.append(((2 * k + 1) * x * polynomials[k] - k * polynomials[k - 1]) / (k + 1))
    return np.where(delay > 0, sum(p * row for p, row in zip(polynomials, z)), signal)


def delay_line(delay, period, *, port="u", name="delay_line"):
    """Exact sampled delay: a shift register, linear between samples.

    Inputs: `port`.  Outputs: `port`.  State: the last values, newest first, all joints of one
    sample together.

    Parameters
    ----------
    delay : array_like, shape (n,)
        Delay [s], not negative; key ``'{name}.delay'``.  Zero passes the signal on, bit for bit.
        The register is as long as the largest delay needs; a longer one needs a new block.
    period : float
        Sample time [s], positive.
    port : str
        Name of the signal.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        A discrete-time block.

    Raises
    ------
    DiagramError
        If the delay is negative or the period not positive.

    """
    if not period > 0:
        raise DiagramError(f"{name}: the period must be positive, got {period} s")
    delay = vector(delay, f"{name}: delay", unit="s", least=0)
    n = delay.size
    length = max(1, int(np.ceil(np.max(delay) / period - 1e-9)))

    def tape(x, u):
        return np.concatenate((u.reshape(1, n), x.reshape(length, n)))

    def update(t, x, u, params):
        return tape(x, u)[:-1].reshape(-1)

    def output(t, x, u, params):
        return np.sum(_taps(params[f"{name}.delay"] / period, length) * tape(x, u), axis=0)

    return ct.nlsys(
        update, output, dt=period, name=name, params={f"{name}.delay": delay},
        inputs=signals(port, n=n), outputs=signals(port, n=n),
        states=[f"past_{k + 1}[{joint}]" for k in range(length) for joint in range(n)])


def _taps(samples, length):
    """Weight of each place of the tape, shape (length + 1, n): a hat about the delay."""
    return np.maximum(0.0, 1.0 - np.abs(samples - np.arange(length + 1)[:, None]))
