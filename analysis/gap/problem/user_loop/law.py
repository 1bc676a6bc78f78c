"""A user's loop in the place of a stated law: its ports, its sensitivities, its joint model."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.problem.law import Filter
from clie_blocks.analysis.gap.problem.planar_chain import PlanarChain
from clie_blocks.analysis.gap.problem.user_loop.checks import check_poles, guarded_loop
from clie_blocks.analysis.gap.problem.user_loop.ports import Ports
from clie_blocks.analysis.records import Record
from clie_blocks.errors import ClieError
from clie_blocks.labels import ports

if TYPE_CHECKING:
    from control import NonlinearIOSystem

BAND = (0.3, 20.0)  # rad/s, in which inertia and damping are read from the linearised loop
NUDGE = 1e-6  # central difference of a linearisation
AFTER = 1e-5  # weight of all states at rest against joints at rest
GLANCE = 1e-4  # s, over which a velocity is read from the position
REACH = 0.4  # step times the fastest pole of the loop
MOST_SUBSTEPS = 50  # of the simulation in one sample
AT_TORQUE = ("load", "friction", "drive")  # ports of causes that the torque port of a loop serves


@dataclasses.dataclass(frozen=True, eq=False)
class LoopLaw:
    """A loop in the place of a stated law; the attributes of a `ControlLaw` are neutral.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem
        The loop.
    ports : Ports
        Its ports.
    period : float
        Sample time of the logs [s].
    substeps : int
        Steps of the simulation in one sample.
    torque, sensor : tuple of (ndarray, ndarray)
        Per joint S_tau(z) and S_0(z), from the linearised loop.
    inertia, damping : ndarray, shape (n,)
        What S_tau / S_0 is near the pass band [kg m^2], [N m s/rad].
    chain : PlanarChain
        Links, unknown.

    """

    diagram: NonlinearIOSystem
    ports: Ports
    period: float
    substeps: int
    torque: tuple[Filter, ...]
    sensor: tuple[Filter, ...]
    inertia: np.ndarray
    damping: np.ndarray
    chain: PlanarChain

    @property
    def discrete(self) -> bool:
        """Whether the loop is in discrete time."""
        return bool(self.diagram.dt)

    @property
    def kp(self) -> np.ndarray:
        """No gain is known."""
        return np.zeros(self.ports.n)

    kd = resolution = kp

    @property
    def saturation(self) -> np.ndarray:
        """No limit is known."""
        return np.full(self.ports.n, np.inf)

    @property
    def numerator(self) -> np.ndarray:
        """No velocity filter is known."""
        return np.zeros((3, self.ports.n))

    denominator = numerator

    @property
    def holds_joints(self) -> bool:
        """A loop is taken as it is: its controller holds the joints."""
        return True

    @property
    def takes_excitation(self) -> bool:
        """Whether the loop has a port for an excitation."""
        return self.ports.has_pe

    @property
    def is_replayable(self) -> bool:
        """The controller cannot be told from the rest of the loop."""
        return False

    def torque_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_tau(z) of joint k [rad/(N m)], of the loop as linearised."""
        return self.torque[k]

    def sensor_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_0(z) of joint k, of the loop as linearised."""
        return self.sensor[k]

    def reaches(self, cause: Any) -> bool:
        """Whether a cause can act at the ports; link data and gears are out of reach."""
        return not cause.needs_links and all(
            piece.port in AT_TORQUE
            or (piece.port == "sensor" and self.ports.has_sensor and not piece.states)
            for piece in cause.pieces)

    def at_rest(self, start: np.ndarray) -> np.ndarray:
        """State of the loop with its joints at rest at a position."""
        return _at_rest(self.diagram, self.ports, start)


def linearised_law(loop: NonlinearIOSystem, found: Ports, record: Record,
                   chain: PlanarChain) -> LoopLaw:
    """Law of a loop, linearised with the joints at rest at the first sample of a log."""
    from scipy.signal import cont2discrete, ss2tf

    period = record.sample_time
    if loop.dt and loop.dt is not True and abs(loop.dt - period) > 1e-6 * period:
        raise ClieError(f"{loop.name} runs every {loop.dt:g} s and the log every {period:g} s; "
                        "build the loop for the sample time of the log")
    a, b, c, d = _linearise(loop, found, record.q[0])
    poles = np.linalg.eigvals(a)
    check_poles(loop, poles, period, len(record) * period, MOST_SUBSTEPS)
    inertia, damping = np.transpose([_joint(a, b[:, k], c[[k, found.n + k]], d[
        [k, found.n + k], k], period if loop.dt else 0.0, found) for k in range(found.n)])
    if not loop.dt:
        speed = np.abs(poles).max(initial=1.0)
        substeps = int(np.clip(np.ceil(period * speed / REACH), 1, MOST_SUBSTEPS))
        a, b, c, d, _ = cont2discrete((a, b, c, d), period)
    else:
        substeps = 1
    torque, sensor = [], []
    for k in range(found.n):
        numerators, denominator = ss2tf(a, b[:, [k]], c[[k, found.n + k]], d[[k, found.n + k]][
            :, [k]])
        torque.append((numerators[0], denominator))
        seen = numerators[1] if found.torque == "pe" else denominator + numerators[1]
        sensor.append((seen, denominator))
    return LoopLaw(loop, found, period, substeps, tuple(torque), tuple(sensor), inertia, damping,
                   chain)


def _linearise(loop: NonlinearIOSystem, found: Ports, start: np.ndarray) -> tuple[np.ndarray, ...]:
    """Matrices from the torque port to q and u, at rest at a position."""
    x, u = _at_rest(loop, found, start), _inputs(loop, start)
    at = [k for k, label in enumerate(loop.input_labels)
          if label.partition("[")[0] == found.torque]
    shown = [k for name in ("q", "u") for k, label in enumerate(loop.output_labels)
             if label.partition("[")[0] == name]

    answer = guarded_loop(loop)

    def both(x, u):
        moved, outputs = answer(x, u)
        return np.append(moved, outputs[shown])

    columns = [(both(x + dx, u + du) - both(x - dx, u - du)) / (2 * NUDGE)
               for dx, du in [*((NUDGE * e, 0.0) for e in np.eye(len(x))),
                              *((0.0, NUDGE * e) for e in np.eye(len(u))[at])]]
    jacobian, n = np.transpose(columns), len(x)
    return jacobian[:n, :n], jacobian[:n, n:], jacobian[n:, :n], jacobian[n:, n:]


def _joint(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, period: float,
           found: Ports) -> tuple[float, float]:
    """Inertia and damping of S_tau / S_0 = 1 / (J s^2 + D s + K) in the band."""
    grid = np.geomspace(*BAND, 60)
    points = np.exp(1j * grid * period) if period else 1j * grid
    moved, commanded = np.transpose([c @ np.linalg.solve(point * np.eye(len(a)) - a, b) + d
                                     for point in points])
    sensor = commanded if found.torque == "pe" else 1.0 + commanded
    if not moved.all():
        raise ClieError("the loop has a torque port that moves no joint; connect it to the input "
                        "of the plant, beside the motor's torque")
    inverse = sensor / moved * np.exp(-0.5j * grid * period)  # a held torque acts half a step late
    shape = np.stack([-grid**2, np.ones_like(grid)], axis=1) / grid[:, None]
    inertia = np.linalg.lstsq(shape, inverse.real / grid, rcond=None)[0][0]
    if not inertia > 0.0:
        raise ClieError("the linearised loop does not answer a torque like a joint with inertia; "
                        "check the sign of the torque port: a positive torque must move q forward")
    return inertia, max(float(np.median(inverse.imag / grid)), 0.0)


def _inputs(loop: NonlinearIOSystem, start: np.ndarray) -> np.ndarray:
    """Inputs at rest: the set-point is the position, all else is zero."""
    u, seen = np.zeros(loop.ninputs), 0
    for k, label in enumerate(loop.input_labels):
        if label.partition("[")[0] == "q_d":
            u[k], seen = start[seen], seen + 1
    return u


def _at_rest(loop: NonlinearIOSystem, found: Ports, start: np.ndarray) -> np.ndarray:
    """State in which the joints stand still at a position, and all else as nearly as it can."""
    from scipy.optimize import least_squares

    u, reach = _inputs(loop, start), 1.0 if loop.dt else GLANCE
    at, answer = ports(loop.output_labels)["q"], guarded_loop(loop)

    def moves(x):
        moved, outputs = answer(x, u)
        rate, q = moved - (x if loop.dt else 0.0), outputs[at]
        later = answer(x + reach * rate, u)[1][at]
        return np.concatenate((q - start, (later - q) / reach, AFTER * rate))

    return least_squares(moves, np.zeros(loop.nstates), xtol=1e-14, ftol=1e-14, gtol=1e-14).x
