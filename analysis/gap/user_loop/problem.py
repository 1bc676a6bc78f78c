"""The problem that a loop of the user's own states: ``diagnose(record, loop=my_loop)``."""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.problem.planar_chain import planar_chain
from clie_blocks.analysis.gap.problem.problem import Nominal, Problem, as_log
from clie_blocks.analysis.gap.user_loop.checks import (
    check_poles,
    check_records,
    check_run,
    guarded_loop,
)
from clie_blocks.analysis.gap.user_loop.ports import as_closed_loop, loop_ports
from clie_blocks.analysis.gap.user_loop.simulator import (
    MOST_SUBSTEPS,
    REACH,
    LoopSimulator,
    can_reach,
)
from clie_blocks.analysis.gap.user_loop.step import GLANCE
from clie_blocks.errors import ClieError
from clie_blocks.labels import ports

BAND = (0.3, 20.0)  # rad/s, in which inertia and damping are read from the linearised loop
TOLERANCE = {"inertia": 0.01, "damping": 0.05, "load": 0.005}  # of a loop's own numbers
NUDGE = 1e-6
AFTER = 1e-5  # weight of all states at rest beside joints at rest


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

    diagram: object
    ports: object
    period: float
    substeps: int
    torque: tuple
    sensor: tuple
    inertia: np.ndarray
    damping: np.ndarray
    chain: object
    corners = None
    variant = "loop"

    @property
    def discrete(self):
        """Whether the loop is in discrete time."""
        return bool(self.diagram.dt)

    @property
    def kp(self):
        """No gain is known."""
        return np.zeros(self.ports.n)

    kd = resolution = kp

    @property
    def saturation(self):
        """No limit is known."""
        return np.full(self.ports.n, np.inf)

    @property
    def numerator(self):
        """No velocity filter is known."""
        return np.zeros((3, self.ports.n))

    denominator = numerator

    def simulator(self, causes):
        """The loop with causes at its ports."""
        return _simulator(self, causes)

    def reaches(self, cause):
        """Whether a cause can act at the ports of the loop."""
        return can_reach(cause, self.ports)

    def at_rest(self, start):
        """State of the loop with its joints at rest at a position."""
        return _at_rest(self.diagram, self.ports, start)


@functools.lru_cache(maxsize=256)
def _simulator(law, causes):
    return LoopSimulator(law, causes)


def loop_problem(loop, records, held_out=None):
    """State the problem of a loop and its logs.

    Parameters
    ----------
    loop : control.NonlinearIOSystem
        The user's model, with the ports of `loop_ports`.
    records : list of Record
        Logs on one time grid each.
    held_out : list of int, optional
        Logs that only judge; by default the last one, when there are two or more.

    Raises
    ------
    ClieError
        If the loop lacks a port, fails, or its sample time is not that of the logs.
    DivergedError
        If the loop is unstable.
    RecordError
        If a record has another number of joints, or another sample time.
    NotIdentifiableError
        If a log is too short.

    """
    from clie_blocks.analysis.records import Robot

    loop = as_closed_loop(loop)
    found = loop_ports(loop)
    check_records(records, found.n, loop.name)
    first = records[0]
    held_out = ([len(records) - 1] if len(records) > 1 else []) if held_out is None else held_out
    robot = Robot(n=found.n, joints=first.joints)
    chain = planar_chain(robot, np.zeros(found.n))
    law = _law(loop, found, first, chain)
    logs = [as_log(record, robot, k) for k, record in enumerate(records)]
    torque = np.sqrt(np.mean(np.concatenate([log.u for log in logs]) ** 2, axis=0))
    nominal = Nominal(
        law.inertia, law.damping, np.zeros(found.n), TOLERANCE["inertia"] * law.inertia,
        TOLERANCE["damping"] * np.maximum(law.damping, 0.1 * law.inertia),
        TOLERANCE["load"] * torque + 1e-12)
    check_run(law, logs[0], {"inertia": law.inertia, "damping": law.damping,
                             "load": nominal.load})
    one = np.ones(found.n)
    return Problem(
        fit=tuple(log for k, log in enumerate(logs) if k not in held_out),
        held_out=tuple(logs[k] for k in held_out), law=law, nominal=nominal, chain=chain,
        gear_ratio=one, shaft_ratio=one, resolution=0 * one, joints=tuple(robot.joints),
        quiet=True)


def _law(loop, found, record, chain):
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


def _linearise(loop, found, start):
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


def _joint(a, b, c, d, period, found):
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


def _inputs(loop, start):
    """Inputs at rest: the set-point is the position, all else is zero."""
    u, seen = np.zeros(loop.ninputs), 0
    for k, label in enumerate(loop.input_labels):
        if label.partition("[")[0] == "q_d":
            u[k], seen = start[seen], seen + 1
    return u


def _at_rest(loop, found, start):
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
