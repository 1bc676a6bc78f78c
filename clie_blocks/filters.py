"""The filters G1 (47) and G2 (34) as linear systems, one channel per joint."""

from collections.abc import Sequence

import control as ct
import numpy as np

from clie_blocks.signals import DiagramError, signals

Matrix = np.ndarray | list[list[float]]


def velocity_filter(n: int, *, highpass: float = 200.0, lowpass: float = 300.0,
                    name: str = "velocity_filter") -> ct.StateSpace:
    """Velocity from position, eq. (47): ``G1 = highpass s/(s + highpass) lowpass/(s + lowpass)``.

    Inputs: q [rad].  Outputs: dq [rad/s].  State: 2 per joint, x[0] [rad] and x[1] [rad/s].

    Parameters
    ----------
    n : int
        Number of joints.
    highpass, lowpass : float
        Corner frequencies [rad/s], positive; the paper's are the defaults.
    name : str
        Name of the block.

    Returns
    -------
    control.StateSpace
        The block; started at rest at position q0 its state is ``x = (q0, 0)``.

    Notes
    -----
    Its slope at low frequency is exact, its delay ``1/highpass + 1/lowpass`` (8.3 ms): in only
    one of two loops that are compared, this delay alone biases the estimates by 16 %.

    """
    _positive(name, highpass=highpass, lowpass=lowpass)
    a = [[-highpass, 0.0], [-highpass * lowpass, -lowpass]]
    b = [[highpass], [highpass * lowpass]]
    return _per_joint(a, b, [[0.0, 1.0]], [[0.0]], n, inputs="q", outputs=["dq"], name=name)


def lowpass(n: int, *, omega_f: float = 300.0, port: str = "u",
            name: str = "lowpass") -> ct.StateSpace:
    """First-order low-pass, eq. (34): ``G2 = omega_f / (s + omega_f)``.

    Inputs: `port`.  Outputs: ``'{port}_f'``.  State: one per joint.

    Parameters
    ----------
    n : int
        Number of joints.
    omega_f : float
        Corner frequency [rad/s], positive.
    port : str
        Name of the signal that is filtered.
    name : str
        Name of the block.

    Returns
    -------
    control.StateSpace
        The block.

    """
    _positive(name, omega_f=omega_f)
    return _per_joint([[-omega_f]], [[omega_f]], [[1.0]], [[0.0]], n,
                      inputs=port, outputs=[f"{port}_f"], name=name)


def lowpass_with_rate(n: int, *, omega_f: float = 300.0,
                      name: str = "lowpass_dq") -> ct.StateSpace:
    """Low-pass of the velocity and its rate, eqs. (34), (35): no acceleration is measured.

    Inputs: dq [rad/s].  Outputs: dq_f [rad/s], y_f = ``omega_f (dq - dq_f)`` [rad/s^2].
    State: one per joint.

    Parameters
    ----------
    n : int
        Number of joints.
    omega_f : float
        Corner frequency [rad/s], positive.
    name : str
        Name of the block.

    Returns
    -------
    control.StateSpace
        The block.

    """
    _positive(name, omega_f=omega_f)
    return _per_joint([[-omega_f]], [[omega_f]], [[1.0], [-omega_f]], [[0.0], [omega_f]], n,
                      inputs="dq", outputs=["dq_f", "y_f"], name=name)


def difference_filter(n: int, period: float, *, taps: int = 2,
                      name: str = "velocity_filter") -> ct.StateSpace:
    """Velocity as the backward difference of a mean of `taps` samples, as servo drives take it.

    Inputs: q [rad].  Outputs: dq = ``(q[k] - q[k - taps]) / (taps period)`` [rad/s].
    State: the last `taps` positions per joint.

    Parameters
    ----------
    n : int
        Number of joints.
    period : float
        Sample time [s].
    taps : int
        Samples averaged; the delay is ``taps / 2`` samples.
    name : str
        Name of the block.

    Returns
    -------
    control.StateSpace
        A discrete-time block; started at rest at position q0 all its states are q0.

    """
    _positive(name, period=period, taps=taps)
    shift = np.eye(taps, k=-1)
    newest = np.eye(taps)[:, :1]
    gain = 1.0 / (taps * period)
    oldest = -gain * np.eye(taps)[-1:]
    return _per_joint(shift, newest, oldest, [[gain]], n, inputs="q", outputs=["dq"], name=name,
                      dt=period)


def _per_joint(a: Matrix, b: Matrix, c: Matrix, d: Matrix, n: int, *, inputs: str,
               outputs: Sequence[str], name: str, dt: float = 0) -> ct.StateSpace:
    """Repeat a single-input filter for n joints; ports are vectors, states joint by joint."""
    eye = np.eye(n)
    rows = [np.kron(eye, np.atleast_2d(row)) for row in c]
    gains = [np.kron(eye, np.atleast_2d(row)) for row in d]
    return ct.ss(np.kron(eye, a), np.kron(eye, b), np.vstack(rows), np.vstack(gains), dt,
                 name=name, inputs=signals(inputs, n=n), outputs=signals(*outputs, n=n))


def _positive(name: str, **corners: float) -> None:
    for key, value in corners.items():
        if not value > 0:
            raise DiagramError(f"{name}: {key} must be positive, got {value}")
