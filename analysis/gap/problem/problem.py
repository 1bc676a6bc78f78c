"""What is to be explained: logs of one robot beside everything that is known of it.

All torques are motor side [N m], all angles joint side [rad].
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.initial_state import with_initial_state
from clie_blocks.analysis.gap.problem.inverse_dynamics import inverse_dynamics_model
from clie_blocks.analysis.gap.problem.planar_chain import PlanarChain, planar_chain
from clie_blocks.analysis.records.control_law import ControlLaw, control_law
from clie_blocks.analysis.records.replay import sample_time
from clie_blocks.errors import NotIdentifiableError, RecordError
from clie_blocks.linear_filters import high_pass

UNKNOWN_TOLERANCE = 10.0  # relative: a number that nobody stated may be anything
LEAST_SAMPLES = 400
ELSEWHERE = 0.1  # of the largest motion, between a stated start and the first sample
DITHER = 30.0  # Hz, above which a position is noise


@dataclasses.dataclass(frozen=True, eq=False)
class Log:
    """One experiment as the diagnosis reads it; arrays have shape (N, n).

    `dither` is the measured noise of the position, above all motion: it goes round the loop as it
    did in the robot, where it keeps dry friction from holding a joint for good.  `speed` is that
    of the first sample, of logs that begin in motion.
    """

    name: str
    q: np.ndarray
    u: np.ndarray
    q_d: np.ndarray
    pe: np.ndarray
    start: np.ndarray
    at_rest: bool
    dither: np.ndarray
    speed: np.ndarray | float = 0.0

    def __len__(self):
        return len(self.q)


@dataclasses.dataclass(frozen=True, eq=False)
class Nominal:
    """Joint model of eq. (8) as stated, per joint, with what the datasheet allows.

    Parameters
    ----------
    inertia, damping, load : ndarray, shape (n,)
        Coefficients of eq. (8) [kg m^2, N m s/rad, N m].
    inertia_tolerance, damping_tolerance, load_tolerance : ndarray, shape (n,)
        Largest deviations [same units].

    """

    inertia: np.ndarray
    damping: np.ndarray
    load: np.ndarray
    inertia_tolerance: np.ndarray
    damping_tolerance: np.ndarray
    load_tolerance: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """Logs, law, nominal model and known link terms of one robot.

    Parameters
    ----------
    fit, held_out : tuple of Log
        Logs to learn from, and logs that only judge.
    law : ControlLaw
        The stated control law.
    nominal : Nominal
        The stated joint model.
    chain : PlanarChain
        The links.
    gear_ratio, shaft_ratio : ndarray, shape (n,)
        Motor turns and encoder-shaft turns per joint turn.
    resolution : ndarray, shape (n,)
        Stated step of the logged position [rad], 0 when not stated.
    joints : tuple of str
        Names.
    inside : tuple of Member
        Causes that the nominal model holds, beside its joint model.
    quiet : bool
        Models run without the measured noise, as the user's simulator does.

    """

    fit: tuple
    held_out: tuple
    law: ControlLaw
    nominal: Nominal
    chain: PlanarChain
    gear_ratio: np.ndarray
    shaft_ratio: np.ndarray
    resolution: np.ndarray
    joints: tuple
    inside: tuple = ()
    quiet: bool = False

    @property
    def n(self):
        """Number of joints."""
        return len(self.joints)

    @property
    def period(self):
        """Sample time of the controller and the logs [s]."""
        return self.law.period

    @property
    def logs(self):
        """All logs, those to learn from first."""
        return self.fit + self.held_out


def problem(robot, records, held_out=None):
    """State the problem of a robot and its records.

    Parameters
    ----------
    robot : Robot
        What is known.
    records : list of Record
        Logs on one time grid each.
    held_out : list of int, optional
        Indices of the logs that only judge; by default the last one, when there are two or more.

    Returns
    -------
    Problem
        Ready for the stages.

    Raises
    ------
    RecordError
        If a record lacks the command or the reference.
    NotIdentifiableError
        If there is no log long enough.

    """
    held_out = ([len(records) - 1] if len(records) > 1 else []) if held_out is None else held_out
    law = _stated_law(robot.controller, records[0])
    logs = [with_initial_state(as_log(record, robot, k), law) for k, record in enumerate(records)]
    if min(map(len, logs)) < LEAST_SAMPLES:
        raise NotIdentifiableError(
            f"{min(logs, key=len).name} has {min(map(len, logs))} samples; a diagnosis needs at "
            f"least {LEAST_SAMPLES} per log, better 20 s of motion: record longer")
    chain = planar_chain(robot, _pose(robot, records[0]))
    ratio = _given(robot.motor.gear_ratio, robot.n, 1.0)
    return Problem(
        fit=tuple(log for k, log in enumerate(logs) if k not in held_out),
        held_out=tuple(logs[k] for k in held_out), law=law,
        nominal=_nominal(robot, chain, ratio, logs, law.period), chain=chain, gear_ratio=ratio,
        shaft_ratio=_given(robot.encoder.shaft_ratio, robot.n, 1.0),
        resolution=_given(robot.encoder.resolution, robot.n, 0.0), joints=tuple(robot.joints))


def _stated_law(controller, record):
    if controller.law not in ("pd", "cascade"):
        raise NotIdentifiableError(
            f"the control law is {controller.law!r}; the diagnosis replays laws of the kind 'pd' "
            "and 'cascade': state [controller] with its gains")
    return control_law(controller, sample_time(record, controller))


def as_log(record, robot, k):
    """Record k of a robot as the diagnosis reads it."""
    if record.u is None:
        raise RecordError(f"{record.source} has no command u; without it nothing can be said of "
                          "the controller: log what it commands")
    still = np.repeat(record.q[:1], len(record), axis=0)
    stem = f"log-{k + 1}"
    start = _plausible_start(getattr(robot.experiments.get(stem), "start", None), record.q)
    return Log(name=record.source or stem, q=record.q, u=record.u,
               q_d=still if record.qd is None else record.qd,
               pe=np.zeros_like(record.q) if record.pe is None else record.pe,
               start=record.q[0] if start is None else start, at_rest=start is not None,
               dither=_dither(record.q, record.sample_time))


def _plausible_start(start, q):
    """The stated start, unless the log begins elsewhere: then it is of another run."""
    if start is None or np.abs(q[0] - start).max() > ELSEWHERE * np.ptp(q, axis=0).max():
        return None
    return start


def _dither(q, period):
    """Part of the measured positions above all motion [rad]."""
    return high_pass(q, 2, min(DITHER, 0.2 / period), 1.0 / period)


def _pose(robot, record):
    for experiment in robot.experiments.values():
        if experiment.set_point is not None:
            return experiment.set_point
    return record.q.mean(axis=0)


def _given(value, n, default):
    return np.full(n, float(default)) if value is None else np.array(value, float)


def _nominal(robot, chain, ratio, logs, period):
    motor, n = robot.motor, robot.n
    if motor.inertia is None:
        inertia, damping, load = inverse_dynamics_model(logs, period)
        loose = UNKNOWN_TOLERANCE
        return Nominal(inertia, damping, load, loose * inertia, loose * (damping + inertia),
                       loose * (np.abs(load) + inertia))
    rotor = ratio * _given(motor.inertia, n, 0.0)
    inertia = rotor + chain.diagonal / ratio
    drag = ratio * _given(motor.viscous_friction, n, 0.0)
    damping = drag + chain.bearing_damping / ratio
    loose = UNKNOWN_TOLERANCE
    tolerance = loose if motor.inertia_tolerance is None else motor.inertia_tolerance
    drag_tolerance = (loose if motor.viscous_friction_tolerance is None
                      else motor.viscous_friction_tolerance)
    offset = motor.torque_offset_tolerance
    return Nominal(
        inertia=inertia, damping=damping, load=np.zeros(n),
        inertia_tolerance=np.maximum(tolerance * rotor, 0.002 * inertia),
        damping_tolerance=np.hypot(drag_tolerance * drag, 0.02 * damping),
        load_tolerance=np.full(n, loose) if offset is None else np.array(offset, float))
