"""Excitation and set-points: functions of time, and the block that turns one into a source."""

from collections.abc import Callable

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint
from clie_blocks.signals import DiagramError, signals


def paper_excitation(t: PerJoint) -> np.ndarray:
    """The paper's excitation, eq. (48) [N m], the same for every joint."""
    return 0.7 * np.sin(2 * np.pi * t) + 0.5 * np.sin(np.pi * t) - 0.25 * np.cos(np.pi * t)


def multisine(t: float, frequency: ArrayLike, amplitude: PerJoint,
              phase: PerJoint = 0.0) -> np.ndarray:
    """Sum of sines: ``sum_k amplitude_k sin(2 pi frequency_k t + phase_k)``.

    Parameters
    ----------
    t : float
        Time [s].
    frequency : array_like, shape (..., m)
        Frequencies [Hz]; a leading axis runs over the joints.
    amplitude : array_like, broadcasts with `frequency`
        Amplitudes, in the unit of the signal.
    phase : array_like, broadcasts with `frequency`
        Phases [rad].

    """
    angle = 2 * np.pi * np.asarray(frequency) * t + phase
    return np.sum(amplitude * np.sin(angle), axis=-1)


def chirp(t: float, f_start: PerJoint, f_end: ArrayLike, duration: float,
          amplitude: PerJoint) -> np.ndarray:
    """Sine whose frequency grows exponentially from f_start to f_end [Hz] in `duration` [s].

    Parameters
    ----------
    t : float
        Time [s].
    f_start, f_end : float or array_like, shape (n,)
        Frequencies [Hz], positive and different from each other.
    duration : float
        Length of the sweep [s].
    amplitude : float or array_like, shape (n,)
        Amplitude, in the unit of the signal.

    """
    octaves = np.log(np.asarray(f_end) / np.asarray(f_start))
    cycles = f_start * duration / octaves * (np.exp(octaves * t / duration) - 1.0)
    return amplitude * np.sin(2 * np.pi * cycles)


def triangle(t: float, period: PerJoint, amplitude: PerJoint) -> np.ndarray:
    """Triangle wave through zero at t = 0, rising first: constant speed both ways.

    Parameters
    ----------
    t : float
        Time [s].
    period : float or array_like, shape (n,)
        Period [s].
    amplitude : float or array_like, shape (n,)
        Peak value, in the unit of the signal.

    """
    phase = np.mod(t / np.asarray(period) + 0.25, 1.0)
    return amplitude * (1.0 - 4.0 * np.abs(phase - 0.5))


def steps(t: float, times: ArrayLike, levels: ArrayLike) -> np.ndarray:
    """Piecewise constant signal: ``levels[k]`` from ``times[k]`` on, zero before the first.

    Parameters
    ----------
    t : float
        Time [s].
    times : array_like, shape (m,)
        Instants of the steps [s], rising.
    levels : array_like, shape (m,) or (n, m)
        Levels, in the unit of the signal.

    """
    levels = np.asarray(levels, float)
    jumps = np.diff(levels, prepend=0.0, axis=-1)
    return np.sum(np.where(t >= np.asarray(times), jumps, 0.0), axis=-1)


def source(signal: Callable[[float], PerJoint] | ArrayLike, port: str, n: int, *,
           name: str | None = None) -> ct.NonlinearIOSystem:
    """Block without inputs that plays a function of time, such as the excitation (48).

    Inputs: none.  Outputs: `port`.  No state.

    Parameters
    ----------
    signal : callable or array_like
        ``signal(t)`` gives a number or shape (n,); a constant is a set-point.
    port : str
        Name of the output.
    n : int
        Number of joints.
    name : str, optional
        Name of the block; by default that of the port.

    Raises
    ------
    DiagramError
        If the signal does not give one value per joint.

    """
    constant = np.asarray(0.0 if callable(signal) else signal, float)
    at: Callable[[float], PerJoint] = signal if callable(signal) else lambda t: constant
    shape = np.shape(at(0.0))
    if shape not in ((), (n,)):
        raise DiagramError(f"source {port!r}: the signal gives shape {shape} at t = 0, but the "
                           f"diagram has {n} joints; return a number or shape ({n},)")

    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        return at(t) * np.ones(n)

    return ct.nlsys(None, output, dt=None, name=name or port, inputs=0, outputs=signals(port, n=n))
