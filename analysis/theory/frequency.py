"""Frequency responses, poles and margins, all from `ct.linearize` of the very diagrams."""

from dataclasses import dataclass

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_discrete_lyapunov

from clie_blocks.analysis.theory.opening import on_path, transfer
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.signals import Diagram, ports

PAPER_TONES = (0.5, 1.0)  # Hz, the frequencies of the excitation (48)
HOLD_POINTS = 20
LARGEST_GAIN = 1e9  # a gain margin beyond it is round-off of an infinite one


@dataclass(frozen=True)
class FilterResponse:
    """A filter compared with an ideal one.

    Parameters
    ----------
    omega : ndarray, shape (m,)
        Frequencies [rad/s].
    response : ndarray of complex, shape (m,)
        Frequency response.
    amplitude_error : ndarray, shape (m,)
        Relative to the ideal, ``|G / ideal| - 1``.
    delay : ndarray, shape (m,)
        Phase lag behind the ideal, as a time [s].

    """

    omega: np.ndarray
    response: np.ndarray
    amplitude_error: np.ndarray
    delay: np.ndarray


def filter_response(block: ct.StateSpace, omega: ArrayLike, derivative: bool = False,
                    ) -> FilterResponse:
    """Frequency response of a filter of one channel, and its errors.

    Parameters
    ----------
    block : control.StateSpace
        The filter; its first input and output are taken.
    omega : array_like, shape (m,)
        Frequencies [rad/s], positive.
    derivative : bool
        The ideal is ``s``, as for G1 (47), instead of 1, as for G2 (34).

    Returns
    -------
    FilterResponse
        At these frequencies.

    """
    omega = np.atleast_1d(np.asarray(omega, float))
    response = np.atleast_1d(np.squeeze(block[0, 0](1j * omega)))
    relative = response / (1j * omega) if derivative else response
    return FilterResponse(omega, response, np.abs(relative) - 1, -np.angle(relative) / omega)


def noise_gain(block: ct.StateSpace, period: float) -> float:
    """Root mean square of a filter's output, over all time, per that of held white noise.

    Parameters
    ----------
    block : control.StateSpace
        The filter; its first input and output are taken.
    period : float
        Time for which a noise sample is held [s].

    Returns
    -------
    float
        For G1 in 1/s: rad/s of velocity noise per rad of position noise.

    """
    channel = on_path(block[0, 0])
    sampled = ct.sample_system(channel, period, "zoh")
    spread = solve_discrete_lyapunov(sampled.A, sampled.B @ sampled.B.T)
    between = (np.arange(HOLD_POINTS) + 0.5) / HOLD_POINTS * period
    return float(np.sqrt(np.mean([_variance(channel, spread, instant) for instant in between])))


def _variance(channel: ct.StateSpace, spread: np.ndarray, instant: float) -> float:
    """Variance of the output some time after a sample, with the state's covariance at it."""
    ahead = ct.sample_system(channel, instant, "zoh")
    moved = ahead.A @ spread @ ahead.A.T + ahead.B @ ahead.B.T
    through = ahead.C @ moved @ ahead.C.T + ahead.D @ ahead.D.T
    return (through + 2 * ahead.C @ ahead.B @ ahead.D.T).item()


@dataclass(frozen=True)
class Poles:
    """Poles with what they mean.

    Parameters
    ----------
    values : ndarray of complex, shape (m,)
        Poles [rad/s], slowest first.

    """

    values: np.ndarray

    @property
    def natural_frequency(self) -> np.ndarray:
        """Distance from zero [rad/s]."""
        return np.abs(self.values)

    @property
    def damping(self) -> np.ndarray:
        """Damping ratio: 1 does not overshoot, negative is unstable."""
        return -self.values.real / np.abs(self.values)

    @property
    def stable(self) -> bool:
        """Whether all of them are left of the imaginary axis."""
        return bool(np.all(self.values.real < 0))


def closed_loop_poles(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, *,
                      filtered: bool = False, q: ArrayLike = 0.0) -> Poles:
    """Poles of the robot under PD control, Fig. 1, with exact velocity or through G1.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains.
    filtered : bool
        Velocity through G1 (47), as in the reading ``'measured'`` of Fig. 2.
    q : array_like, shape (n,)
        Position at which a nonlinear plant is linearised [rad].

    Returns
    -------
    Poles
        Of the robot's loop alone.

    """
    diagram = robot_loop(plant, kp, kd, filtered)
    return _robot_poles(diagram, ct.linearize(diagram, operating_state(diagram, plant, q), 0))


def _robot_poles(diagram: Diagram, linear: ct.StateSpace) -> Poles:
    """Poles of a linearised diagram on the paths from its references to the robot's position."""
    inputs = [k for label in ("q_d", "pe") for k in ports(diagram.input_labels)[label]]
    outputs = ports(diagram.output_labels)["q"]
    values = np.linalg.eigvals(on_path(linear[outputs, inputs]).A)
    return Poles(values[np.argsort(np.abs(values))])


def gain_sweep(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, factors: ArrayLike, *,
               filtered: bool = False, q: ArrayLike = 0.0) -> np.ndarray:
    """Poles while both gains are multiplied by a factor.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains at factor one.
    factors : array_like, shape (m,)
        The factors.
    filtered : bool
        Velocity through G1 (47).
    q : array_like, shape (n,)
        Position at which a nonlinear plant is linearised [rad].

    Returns
    -------
    ndarray of complex, shape (m, poles)
        One row per factor.

    """
    diagram = robot_loop(plant, kp, kd, filtered)
    flat, state = compile_diagram(diagram).as_nlsys(), operating_state(diagram, plant, q)
    gains = {key: np.asarray(value) for key, value in diagram.params.items()
             if key.split(".")[-1] in ("kp", "kd") and not key.startswith(f"{plant.name}.")}
    loops = (ct.linearize(flat, state, 0, params={key: f * gain for key, gain in gains.items()})
             for f in np.asarray(factors))
    return np.array([_robot_poles(diagram, loop).values for loop in loops])


@dataclass(frozen=True)
class Margins:
    """Margins of one loop, cut at the plant's input with the other joints closed.

    Parameters
    ----------
    gain, least_gain : float
        Factors on the loop gain above and below which it becomes unstable; infinite and zero if
        none.
    phase : float
        Phase margin [deg].
    crossover : float
        Frequency at which the loop gain is one [rad/s].
    peak_sensitivity : float
        Largest ``|S|``; its inverse is the distance of the loop from -1.
    loop : control.StateSpace
        The loop transfer L, negative feedback: ``S = 1 / (1 + L)``.

    """

    gain: float
    least_gain: float
    phase: float
    crossover: float
    peak_sensitivity: float
    loop: ct.StateSpace

    @property
    def delay(self) -> float:
        """Delay margin: dead time that would make the loop unstable [s]."""
        return np.radians(self.phase) / self.crossover

    def sensitivities(self, omega: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return S and T at frequencies [rad/s]."""
        value = frequency_response(self.loop, omega)
        return 1 / (1 + value), value / (1 + value)


def margins(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, joint: int, *,
            filtered: bool = False, q: ArrayLike = 0.0) -> Margins:
    """Stability margins of one joint at the plant's input.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains.
    joint : int
        Which joint, from 0; the other loops stay closed.
    filtered : bool
        Velocity through G1 (47).
    q : array_like, shape (n,)
        Position at which a nonlinear plant is linearised [rad].

    Returns
    -------
    Margins
        See there.

    """
    diagram = robot_loop(plant, kp, kd, filtered)
    loop = -transfer(diagram, f"{plant.name}.u[{joint}]", operating_state(diagram, plant, q))
    gains, phases, _, _, crossovers, _ = ct.stability_margins(loop, returnall=True)
    if len(phases) == 0:
        raise NotIdentifiableError(f"joint {joint + 1}: the loop gain never crosses one; the "
                                   "gains are too small for margins to mean anything")
    gains, worst = gains[gains < LARGEST_GAIN], np.argmin(np.abs(phases))
    omega = np.geomspace(crossovers[worst] / 100, crossovers[worst] * 1000, 4000)
    peak = np.max(np.abs(1 / (1 + frequency_response(loop, omega))))
    return Margins(float(np.min(gains[gains > 1], initial=np.inf)),
                   float(np.max(gains[gains < 1], initial=0.0)), float(phases[worst]),
                   float(crossovers[worst]), float(peak), loop)


def frequency_response(system: ct.StateSpace, omega: ArrayLike) -> np.ndarray:
    """Frequency response of one channel at frequencies [rad/s], all of them in one solve."""
    shifted = 1j * np.asarray(omega)[:, None, None] * np.eye(system.nstates) - system.A
    return (system.C @ np.linalg.solve(shifted, system.B) + system.D)[:, 0, 0]


def robot_loop(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, filtered: bool,
               ) -> Diagram:
    """Diagram that holds the robot's loop: Fig. 1, or Fig. 2 with G1 in the robot's half."""
    if filtered:
        return clie_loop(plant, kp, kd, 1.0, velocity="measured")
    return joint_loop(plant, kp, kd)


def operating_state(diagram: Diagram, plant: ct.NonlinearIOSystem, q: ArrayLike) -> np.ndarray:
    """State of a diagram with the plant at rest at a position, everything else zero.

    Parameters
    ----------
    diagram : clie_blocks.signals.Diagram
        The diagram.
    plant : control.NonlinearIOSystem
        Its plant.
    q : array_like, shape (n,)
        Position [rad].

    """
    x = np.zeros(diagram.nstates)
    start = diagram.state_offset[[block.name for block in diagram.syslist].index(plant.name)]
    x[start:start + plant.ninputs] = q
    return x
