"""Measured motion as textbook identification uses it: smoothed, differentiated, filtered alike."""

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Scene
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.screening import scene
from clie_blocks.robot_loop.dynamics import State
from clie_blocks.robot_loop.links import coupling_torque, gravity_torque, tip_load_torque

SMOOTH = 40.0  # Hz of the zero-phase filter before differentiation
CORNER = 8.0  # Hz of the parallel filter, over the bandwidth of the motion
KEPT = 2.5  # samples per period of the parallel filter's corner
EDGE = 0.5  # s left out at both ends of a log
OPPOSING = ("load", "friction")  # ports of causes that are a torque of the measured motion
# A column of it is the torque itself wherever that drives: it would explain any torque.
OF_THE_TORQUE = ("directional_efficiency",)
BODIES = {"payload": tip_load_torque, "coupling": coupling_torque}
Values = dict[str, np.ndarray]


@dataclasses.dataclass(frozen=True, eq=False)
class SmoothedMotion:
    """Measured motion of one log: positions, velocities and commands, and accelerations.

    All have shape (N, n); accelerations are in rad/s^2.
    """

    state: State
    ddq: np.ndarray


def smooth_motions(problem: Problem, logs: Iterable[Log]) -> list[SmoothedMotion]:
    """Measured motion of some logs, by zero-phase smoothing and central differences."""
    return [_smooth_motion(problem, log) for log in logs]


def _smooth_motion(problem: Problem, log: Log) -> SmoothedMotion:
    from scipy.signal import butter, sosfiltfilt

    h = problem.period
    low_pass = butter(4, min(SMOOTH, 0.2 / h), fs=1.0 / h, output="sos")
    q = sosfiltfilt(low_pass, log.q, axis=0)
    dq = np.gradient(q, h, axis=0)
    time = h * np.arange(len(q))[:, None]
    return SmoothedMotion(State(q, dq, log.u, time, h, problem.links, problem.gear_ratio),
                          np.gradient(dq, h, axis=0))


def net_command(motion: SmoothedMotion) -> np.ndarray:
    """Command less the link torques that the nominal model knows [N m], shape (N, n)."""
    s, torque = motion.state, motion.state.u
    if s.links.has_coupling:
        torque = torque - coupling_torque(s.links, s.q, s.dq, motion.ddq) / s.ratio
    if s.links.has_gravity:
        torque = torque - gravity_torque(s.links, s.q) / s.ratio
    return torque


def opposing_torque(motion: SmoothedMotion, cause: Cause, values: Values) -> np.ndarray:
    """Torque with which a cause would oppose the measured motion [N m], shape (N, n)."""
    s, torque = motion.state, np.zeros_like(motion.state.q)
    if cause.name in BODIES:
        size = next(iter(values.values()))
        return size * BODIES[cause.name](s.links, s.q, s.dq, motion.ddq) / s.ratio
    for piece in cause.pieces:
        if piece.port == "load":
            torque = torque + piece.act(s, [], values)[0]
        else:
            (forward, backward), _ = piece.act(s, [], values)
            torque = torque + np.where(s.dq > 0, forward, -np.asarray(backward))
    return torque


def regressors(problem: Problem, causes: Iterable[Cause]) -> list[Cause]:
    """Return the causes whose torque follows from the measured motion alone, at any time."""
    return [cause for cause in causes
            if (cause.name in BODIES or all(piece.port in OPPOSING and not piece.states
                                            for piece in cause.pieces))
            and cause.name not in OF_THE_TORQUE
            and (problem.links.known or not cause.needs_links)
            and all(number.scope != "log" for number in cause.numbers)]


@dataclasses.dataclass(frozen=True)
class _StatedInertia:
    """The joint model from which the search grid takes its inertia."""

    values: Values


def motion_scene(problem: Problem, motions: Sequence[SmoothedMotion]) -> Scene:
    """Sizes of the measured motion, from which causes choose their search grid."""
    stated = _StatedInertia({"inertia": problem.nominal.inertia})
    return scene(problem, stated, [motion.state for motion in motions])


def parallel_filter(problem: Problem, signals: Iterable[np.ndarray]) -> np.ndarray:
    """Signals of several logs, (N, n) each, after the parallel filter, thinned and joined."""
    from scipy.signal import butter, sosfiltfilt

    h = problem.period
    low_pass = butter(4, min(CORNER, 0.2 / h), fs=1.0 / h, output="sos")
    edge, step = round(EDGE / h), max(1, round(1.0 / (KEPT * CORNER * h)))
    return np.concatenate([sosfiltfilt(low_pass, x, axis=0)[edge:-edge:step] for x in signals])
