"""From goal to motion of a servo whose law is unknown: dead time, and how it divides.

A second-order servo reaches 5 % of a step some time after the goal even without any delay; the
fit of lag and delay together says how much of that time is delay.
"""

import dataclasses

import numpy as np

from clie_blocks.errors import NotIdentifiableError

REACHED = 0.05  # of a step
FINE = 10  # steps of the fitted servo per sample of the log
SETTLE = 50  # samples after the start that are not judged
STARTS = (15.0, 40.0)  # rad/s


@dataclasses.dataclass(frozen=True)
class GoalPath:
    """How a servo follows its goal.

    Parameters
    ----------
    frequency : float
        Of the servo as a second-order lag [rad/s].
    damping_ratio : float
        Of that lag.
    offset : float
        Constant error [rad].
    delay : float
        Pure delay of goal and reading [s].
    left : float
        RMS of what this does not explain [rad].

    """

    frequency: float
    damping_ratio: float
    offset: float
    delay: float
    left: float


def dead_times(record, k, least=0.05, rest=5):
    """Times from each step of the goal to 5 % of the motion [s].

    Parameters
    ----------
    record : Record
        With goals qd and positions q.
    k : int
        Joint.
    least : float
        Smallest step of the goal that counts [rad].
    rest : int
        Samples for which the goal must have stood still before.

    """
    goal, q = record.qd[:, k], record.q[:, k]
    moved = np.diff(goal)
    found = []
    for i in np.flatnonzero(np.abs(moved) > least) + 1:
        if i >= rest and not moved[i - rest:i - 1].any():
            after = np.sign(moved[i - 1]) * (q[i:] - q[i])
            late = np.flatnonzero(after > REACHED * abs(moved[i - 1]))
            found += [record.time[i + late[0]] - record.time[i]] if late.size else []
    return np.array(found)


def goal_path(record, k, delayed=True):
    """Fit lag and delay of a servo; without delay for comparison.

    Parameters
    ----------
    record : Record
        With goals qd and positions q on an even clock.
    k : int
        Joint.
    delayed : bool
        Whether a delay is fitted, too.

    Raises
    ------
    NotIdentifiableError
        If the goal never moves.

    """
    from scipy.optimize import least_squares

    goal, q, period = record.qd[:, k], record.q[:, k], record.sample_time
    if np.ptp(goal) == 0.0:
        raise NotIdentifiableError(f"{record.source}: the goal of {record.joints[k]} never moves, "
                                   "so that its path cannot be told")

    def error(p):
        delay = p[3] if delayed else 0.0
        return (followed(goal, q[0], period, *p[:3], delay) - q)[SETTLE:]

    fits = [least_squares(error, (start, 1.0, 0.0, period), x_scale=(5.0, 0.2, 0.01, 0.01),
                          bounds=((1.0, 0.2, -1.0, 0.0), (300.0, 5.0, 1.0, 0.3)), max_nfev=60)
            for start in STARTS]
    best = min(fits, key=lambda fit: fit.cost)
    *numbers, delay = map(float, best.x)
    return GoalPath(*numbers, delay if delayed else 0.0,
                    float(np.sqrt(np.mean(best.fun**2))))


def followed(goal, start, period, frequency, damping_ratio, offset, delay):
    """Position of a second-order servo that holds each goal, and is read late, shape (N,)."""
    from scipy.signal import cont2discrete, lfilter

    step = period / FINE
    b, a, _ = cont2discrete(
        ([frequency**2], [1.0, 2 * damping_ratio * frequency, frequency**2]), step, "zoh")
    fine = lfilter(b.ravel(), a, np.repeat(goal, FINE) - start) + start + offset
    return np.interp(period * np.arange(len(goal)) - delay, step * np.arange(fine.size), fine)
