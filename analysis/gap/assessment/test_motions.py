"""Experiments that could be run next, inside what the robot may do.

The torque limit is the stated one, else the largest command of the logs; positions and speeds stay
inside what the logs have reached.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.problem import Log
from clie_blocks.analysis.gap.residual.noise import decimated
from clie_blocks.errors import DivergedError

DURATION = 20.0  # s
SHARE = 0.9  # of each limit that a run may use
LINES = 10  # of a multisine
REPEAT = 10.0  # s, period of a multisine
BANDS = ((0.1, 3.0), (0.1, 9.0), (1.0, 12.0))  # Hz


@dataclasses.dataclass(frozen=True, eq=False)
class Limits:
    """What a run may reach, per joint.

    Parameters
    ----------
    lowest, highest : ndarray, shape (n,)
        Positions [rad].
    speed, torque : ndarray, shape (n,)
        Largest speed [rad/s] and command [N m].

    """

    lowest: np.ndarray
    highest: np.ndarray
    speed: np.ndarray
    torque: np.ndarray

    @property
    def centre(self):
        """Middle of the positions."""
        return (self.lowest + self.highest) / 2

    @property
    def reach(self):
        """Largest distance from the middle."""
        return (self.highest - self.lowest) / 2 + 1e-9


def motion_limits(problem):
    """Return the limits of a robot: stated torque, and what its logs have reached."""
    logs = problem.logs
    reached = np.max([np.abs(log.u).max(axis=0) for log in logs], axis=0)
    rates = [_rate(log.q, problem.period) for log in logs]
    return Limits(np.min([log.q.min(axis=0) for log in logs], axis=0),
                  np.max([log.q.max(axis=0) for log in logs], axis=0),
                  np.max([np.abs(rate).max(axis=0) for rate in rates], axis=0),
                  np.where(np.isfinite(problem.law.saturation), problem.law.saturation, reached))


def _rate(q, period):
    """Rates of positions without their noise [rad/s]."""
    slow = decimated(q, period)
    return np.gradient(slow, len(q) / len(slow) * period, axis=0)


def elementary_motions(problem, bounds):
    """Named experiments that an engineer would think of, as logs without an answer."""
    time = _time(problem)
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / 10.0))
    sweep = np.sin(2 * np.pi * (0.1 * time + (8.0 - 0.1) * time**2 / (2 * DURATION)))
    ladder = np.sin(2 * np.pi * 0.25 * time) * np.floor(1 + 4 * time / DURATION) / 4
    still = 0.0 * bounds.reach + 0.0 * time
    return [test_motion(problem, bounds, *parts) for parts in (
        ("slow triangle over the full travel", bounds.reach * triangle, still),
        ("ladder of amplitudes", bounds.reach * ladder, still),
        ("chirp of torque, 0.1 to 8 Hz", still, bounds.torque * sweep))]


def multisine_motion(problem, bounds, band, phases, share):
    """A multisine of torque and set-point; joints have lines of their own.

    Parameters
    ----------
    band : tuple of float
        Lowest and highest line [Hz].
    phases : ndarray, shape (2, LINES, n)
        Of the lines of set-point and torque [rad].
    share : float
        Of the motion that comes from the set-point.

    """
    n, time = problem.n, _time(problem)
    lines = np.unique(np.round(np.geomspace(*band, LINES) * REPEAT))
    waves = np.zeros((2, len(time), n))
    for k in range(n):
        own = (lines[:, None] * n + k).T / (n * REPEAT) if n > 1 else lines[None] / REPEAT
        for kind in (0, 1):
            waves[kind, :, k] = np.sin(2 * np.pi * own * time
                                       + phases[kind, :len(lines), k]).sum(axis=1)
    waves /= np.abs(waves).max(axis=1, keepdims=True)
    name = f"multisine, {band[0]:g} to {band[1]:g} Hz, {share:.0%} of it set-point"
    return test_motion(problem, bounds, name, share * bounds.reach * waves[0],
               (1 - share) * bounds.torque * waves[1])


def _time(problem):
    return problem.period * np.arange(round(DURATION / problem.period))[:, None]


def test_motion(problem, bounds, name, motion, torque):
    """One experiment around the middle of the positions, as a log without an answer."""
    q_d, zero = bounds.centre + motion, np.zeros_like(motion)
    return Log(name, q_d, zero, q_d, torque, bounds.centre, problem.fit[0].at_rest, zero)


def scale_inside(at, log, bounds):
    """Scale an experiment down (or up) until a model of the robot stays inside limits.

    Parameters
    ----------
    at : Hypothesis
        The model.
    log : Log
        The experiment.
    bounds : Limits
        The limits.

    Returns
    -------
    log : Log
        The experiment.
    q : ndarray, shape (N, n)
        The model's motion in it [rad]; both None where even small motions leave the limits.

    """
    for _ in range(3):
        try:
            q, u = at.simulator.run(log, at.of_log(0))
        except DivergedError:
            factor = 0.3
        else:
            rate = _rate(q, at.problem.period)
            used = np.max([np.abs(q - bounds.centre).max(axis=0) / bounds.reach,
                           np.abs(rate).max(axis=0) / (bounds.speed + 1e-9),
                           np.abs(u).max(axis=0) / (bounds.torque + 1e-12)])
            if 0.7 * SHARE < used <= 1.0:
                return log, q
            factor = SHARE / used
        q_d = bounds.centre + factor * (log.q_d - bounds.centre)
        log = dataclasses.replace(log, q=q_d, q_d=q_d, pe=factor * log.pe)
    return None, None
