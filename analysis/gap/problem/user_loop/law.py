"""A user's loop instead of a stated law: its ports, its sensitivities, its joint model."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.law import Filter, ReachableCause
from clie_blocks.analysis.gap.problem.user_loop.checks import check_poles, guarded_loop
from clie_blocks.analysis.gap.problem.user_loop.ports import (
    COMMAND,
    EXCITATION,
    POSITION,
    REFERENCE,
    Ports,
)
from clie_blocks.analysis.records import Record
from clie_blocks.errors import ClieError
from clie_blocks.labels import ports
from clie_blocks.robot_loop.links import Links

if TYPE_CHECKING:
    from control import NonlinearIOSystem

JOINT_BAND = (0.3, 20.0)  # rad/s, in which inertia and damping are read from the linearised loop
PERTURBATION = 1e-6  # of states and inputs, in the central differences of a linearisation
REST_WEIGHT = 1e-5  # of all other states at rest, relative to joints at rest
VELOCITY_STEP = 1e-4  # s, of the difference quotient that gives a velocity from the position
LARGEST_STEP = 0.4  # step of the simulation times the fastest pole of the loop
MOST_SUBSTEPS = 50  # of the simulation in one sample
Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""A, B, C, D of a linear system."""

AT_TORQUE = ("load", "friction", "drive")  # ports of causes that act at the torque port of a loop


@dataclasses.dataclass(frozen=True, eq=False)
class LoopLaw:
    """A loop instead of a stated law; the attributes of a `ControlLaw` are neutral.

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
        Of the joint, from S_tau / S_0 at low frequencies [kg m^2], [N m s/rad].
    links : Links
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
    links: Links

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
        """The controller cannot be separated from the rest of the loop."""
        return False

    def torque_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_tau(z) of joint k [rad/(N m)], of the loop as linearised."""
        return self.torque[k]

    def sensor_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_0(z) of joint k, of the loop as linearised."""
        return self.sensor[k]

    def reaches(self, cause: ReachableCause) -> bool:
        """Whether a cause can act at the ports; link data and gears are out of reach."""
        return not cause.needs_links and all(
            piece.port in AT_TORQUE
            or (piece.port == "sensor" and self.ports.has_sensor and not piece.states)
            for piece in cause.pieces)

    @property
    def beyond_reach(self) -> str:
        """What the ports do not reach."""
        return "out of reach at the ports of a loop"

    def at_rest(self, start: np.ndarray) -> np.ndarray:
        """State of the loop with its joints at rest at a position."""
        return _at_rest(self.diagram, self.ports, start)


def linearised_law(loop: NonlinearIOSystem, loop_ports: Ports, record: Record,
                   links: Links) -> LoopLaw:
    """Law of a loop, linearised with the joints at rest at the first sample of a log."""
    period = record.sample_time
    if loop.dt and loop.dt is not True and abs(loop.dt - period) > 1e-6 * period:
        raise ClieError(f"{loop.name} runs every {loop.dt:g} s and the log every {period:g} s; "
                        "build the loop for the sample time of the log")
    system = _linearise(loop, loop_ports, record.q[0])
    poles = np.linalg.eigvals(system[0])
    check_poles(loop, poles, period, len(record) * period, MOST_SUBSTEPS)
    joints = [_joint(*_at_joint(system, k), period if loop.dt else 0.0, loop_ports)
              for k in range(loop_ports.n)]
    inertia, damping = np.transpose(joints)
    torque, sensor = _sensitivities(system, loop_ports, 0.0 if loop.dt else period)
    return LoopLaw(loop, loop_ports, period, 1 if loop.dt else _substeps(poles, period), torque,
                   sensor, inertia, damping, links)


def _substeps(poles: np.ndarray, period: float) -> int:
    """Steps of the simulation of a continuous loop in one sample."""
    fastest = np.abs(poles).max(initial=1.0)
    return int(np.clip(np.ceil(period * fastest / LARGEST_STEP), 1, MOST_SUBSTEPS))


def _sensitivities(system: Matrices, loop_ports: Ports, period: float,
                   ) -> tuple[tuple[Filter, ...], tuple[Filter, ...]]:
    """S_tau(z) and S_0(z) of each joint; `period` samples a continuous loop, 0 if it is a map."""
    from scipy.signal import cont2discrete, ss2tf

    if period:
        system = cont2discrete(system, period)[:4]
    torque, sensor = [], []
    for k in range(loop_ports.n):
        a, b, c, d = _at_joint(system, k)
        (of_q, of_u), denominator = ss2tf(a, b[:, None], c, d[:, None])
        torque.append((of_q, denominator))
        sensor.append((of_u if loop_ports.torque == EXCITATION else denominator + of_u,
                       denominator))
    return tuple(torque), tuple(sensor)


def _at_joint(system: Matrices, k: int) -> Matrices:
    """Matrices from the torque at joint k to its position and command."""
    a, b, c, d = system
    rows = [k, b.shape[1] + k]
    return a, b[:, k], c[rows], d[rows, k]


def _linearise(loop: NonlinearIOSystem, loop_ports: Ports, start: np.ndarray) -> Matrices:
    """Matrices from the torque port to q and u, at rest at a position."""
    state, inputs = _at_rest(loop, loop_ports, start), _inputs(loop, start)
    torque = [k for k, label in enumerate(loop.input_labels)
              if label.partition("[")[0] == loop_ports.torque]
    shown = [k for name in (POSITION, COMMAND) for k, label in enumerate(loop.output_labels)
             if label.partition("[")[0] == name]
    evaluate = guarded_loop(loop)

    def rates_and_outputs(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        rates, outputs = evaluate(x, u)
        return np.append(rates, outputs[shown])

    def derivative(dx: np.ndarray | float, du: np.ndarray | float) -> np.ndarray:
        change = (rates_and_outputs(state + dx, inputs + du)
                  - rates_and_outputs(state - dx, inputs - du))
        return change / (2 * PERTURBATION)

    columns = [derivative(PERTURBATION * unit, 0.0) for unit in np.eye(len(state))]
    columns += [derivative(0.0, PERTURBATION * unit) for unit in np.eye(len(inputs))[torque]]
    jacobian, n = np.transpose(columns), len(state)
    return jacobian[:n, :n], jacobian[:n, n:], jacobian[n:, :n], jacobian[n:, n:]


def _joint(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, period: float,
           loop_ports: Ports) -> tuple[float, float]:
    """Inertia and damping of S_tau / S_0 = 1 / (J s^2 + D s + K) in the band."""
    grid = np.geomspace(*JOINT_BAND, 60)
    points = np.exp(1j * grid * period) if period else 1j * grid
    position, command = np.transpose([c @ np.linalg.solve(point * np.eye(len(a)) - a, b) + d
                                      for point in points])
    sensor = command if loop_ports.torque == EXCITATION else 1.0 + command
    if not position.all():
        raise ClieError("the loop has a torque port that moves no joint; connect it to the input "
                        "of the plant, in addition to the motor's torque")
    # A torque that is held over a step acts with a delay of half a step.
    inverse = sensor / position * np.exp(-0.5j * grid * period)
    shape = np.stack([-grid**2, np.ones_like(grid)], axis=1) / grid[:, None]
    inertia = np.linalg.lstsq(shape, inverse.real / grid, rcond=None)[0][0]
    if not inertia > 0.0:
        raise ClieError("the linearised loop does not answer a torque like a joint with inertia; "
                        "check the sign of the torque port: a positive torque must move q forward")
    return inertia, max(float(np.median(inverse.imag / grid)), 0.0)


def _inputs(loop: NonlinearIOSystem, start: np.ndarray) -> np.ndarray:
    """Inputs at rest: the set-point is the position, all else is zero."""
    inputs = np.zeros(loop.ninputs)
    inputs[ports(loop.input_labels)[REFERENCE]] = start
    return inputs


def _at_rest(loop: NonlinearIOSystem, loop_ports: Ports, start: np.ndarray) -> np.ndarray:
    """State in which the joints rest at a position, and all other states as nearly as they can."""
    from scipy.optimize import least_squares

    inputs, step = _inputs(loop, start), 1.0 if loop.dt else VELOCITY_STEP
    shown, evaluate = ports(loop.output_labels)[POSITION], guarded_loop(loop)

    def motion(x: np.ndarray) -> np.ndarray:
        rates, outputs = evaluate(x, inputs)
        rates, q = rates - (x if loop.dt else 0.0), outputs[shown]
        later = evaluate(x + step * rates, inputs)[1][shown]
        return np.concatenate((q - start, (later - q) / step, REST_WEIGHT * rates))

    return least_squares(motion, np.zeros(loop.nstates), xtol=1e-14, ftol=1e-14, gtol=1e-14).x
