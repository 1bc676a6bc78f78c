"""Measured motion as textbook identification uses it: smoothed, differentiated, filtered alike."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.planar_chain import (
    coupling_torque,
    gravity_torque,
    tip_load_torque,
)
from clie_blocks.analysis.gap.search.screening import scene
from clie_blocks.analysis.gap.simulation.dynamics import State

SMOOTH = 40.0  # Hz of the zero-phase filter before differentiation
CORNER = 8.0  # Hz of the parallel filter, over the bandwidth of the motion
KEPT = 2.5  # samples per period of the parallel filter's corner
EDGE = 0.5  # s left out at both ends of a log
OPPOSING = ("load", "friction")  # ports of causes that are a torque of the measured motion
BODIES = {"payload": tip_load_torque, "coupling": coupling_torque}


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Measured motion of one log.

    Parameters
    ----------
    state : State
        Positions, velocities and commands, shape (N, n).
    ddq : ndarray, shape (N, n)
        Accelerations [rad/s^2].

    """

    state: State
    ddq: np.ndarray


def motions(problem, logs):
    """Measured motion of some logs, by zero-phase smoothing and central differences."""
    return [_motion(problem, log) for log in logs]


def _motion(problem, log):
    from scipy.signal import butter, sosfiltfilt

    h = problem.period
    low = butter(4, min(SMOOTH, 0.2 / h), fs=1.0 / h, output="sos")
    q = sosfiltfilt(low, log.q, axis=0)
    dq = np.gradient(q, h, axis=0)
    time = h * np.arange(len(q))[:, None]
    return Motion(State(q, dq, log.u, time, h, problem.chain, problem.gear_ratio),
                  np.gradient(dq, h, axis=0))


def net_command(motion):
    """Command less the link torques that the nominal model knows [N m], shape (N, n)."""
    s, torque = motion.state, motion.state.u
    if s.chain.has_coupling:
        torque = torque - coupling_torque(s.chain, s.q, s.dq, motion.ddq) / s.ratio
    if s.chain.has_gravity:
        torque = torque - gravity_torque(s.chain, s.q) / s.ratio
    return torque


def opposing(motion, cause, values):
    """Torque that a cause would oppose to the measured motion [N m], shape (N, n)."""
    s, torque = motion.state, np.zeros_like(motion.state.q)
    if cause.name in BODIES:
        size = next(iter(values.values()))
        return size * BODIES[cause.name](s.chain, s.q, s.dq, motion.ddq) / s.ratio
    for piece in cause.pieces:
        if piece.port == "load":
            torque = torque + piece.act(s, [], values)[0]
        else:
            forward, backward = piece.act(s, values)
            torque = torque + np.where(s.dq > 0, forward, -np.asarray(backward))
    return torque


def regressors(problem, causes):
    """Return the causes whose torque follows from the measured motion alone, at any time."""
    return [cause for cause in causes
            if (cause.name in BODIES or all(piece.port in OPPOSING and not piece.states
                                            for piece in cause.pieces))
            and (problem.chain.known or not cause.needs_links)
            and all(number.scope != "log" for number in cause.numbers)]


def sizes(problem, found):
    """Sizes of the measured motion, from which causes choose where to look."""
    nominal = type("Nominal", (), {"values": {"inertia": problem.nominal.inertia}})
    return scene(problem, nominal, [motion.state for motion in found])


def filtered(problem, signals):
    """Signals of several logs, (N, n) each, after the parallel filter, thinned and joined."""
    from scipy.signal import butter, sosfiltfilt

    h = problem.period
    low = butter(4, min(CORNER, 0.2 / h), fs=1.0 / h, output="sos")
    edge, step = round(EDGE / h), max(1, round(1.0 / (KEPT * CORNER * h)))
    return np.concatenate([sosfiltfilt(low, x, axis=0)[edge:-edge:step] for x in signals])
