"""How a cause would change the predicted motion: the columns of the screening.

A cause without memory acts on the base motion as a known course of torque (or of sensor error),
and the sensitivity filter of the loop carries it to the measured position.  The kernel is the one
that is simulated.  A cause with memory, or one that changes the inertia, is simulated.
"""

import numpy as np

from clie_blocks.analysis.gap.hypothesis import DIVERGED, Member, hypothesis
from clie_blocks.analysis.gap.lanes import WIDE
from clie_blocks.analysis.gap.noise import decimated
from clie_blocks.analysis.gap.sensitivity import sensor_sensitivity, torque_sensitivity
from clie_blocks.analysis.gap.simulated import State
from clie_blocks.compiled.recursion import lfilter

FILTERED = ("load", "friction", "drive", "sensor")


def base_motion(centre):
    """States of a hypothesis along each fit log, arrays of shape (N, n)."""
    problem, found = centre.problem, []
    for j, log in enumerate(problem.fit):
        q, u = centre.simulator.run(log, centre.of_log(j))
        time = problem.period * np.arange(len(log))[:, None]
        found.append(State(q, np.gradient(q, problem.period, axis=0), u, time, problem.period,
                           problem.chain, problem.gear_ratio))
    return found


def responses(centre, motion, cause, sets):
    """Changes of the measured positions when a cause is switched on, for many sets of numbers.

    Parameters
    ----------
    centre : Hypothesis
        The model without the cause.
    motion : list of State
        Its `base_motion`.
    cause : Cause
        The cause.
    sets : list of dict
        Numbers of the cause at all joints.

    Returns
    -------
    iterable of list of ndarray
        For each set, one change per fit log, `decimated`; made as they are asked for, since all
        of them are gigabytes on an arm of many joints.

    """
    if all(piece.port in FILTERED and not piece.states for piece in cause.pieces):
        return ([decimated(_filtered(centre, s, cause, _of_log(values, j)), centre.problem.period)
                 for j, s in enumerate(motion)] for values in sets)
    return _simulated(centre, motion, cause, sets)


def _of_log(values, j):
    return {name: value[j] if np.ndim(value) == 2 else value for name, value in values.items()}


def _simulated(centre, motion, cause, sets):
    joints = tuple(range(centre.problem.n))
    trials = [hypothesis(centre.problem, (*centre.members, Member(cause, joints, values, values)),
                         centre) for values in sets]
    before = [decimated(s.q, centre.problem.period) for s in motion]
    for first in range(0, len(trials), WIDE):
        group = trials[first:first + WIDE]
        runs = [group[0].means(j, [trial.values for trial in group]) for j in range(len(motion))]
        for i in range(len(group)):
            yield [_bounded(run[i].T - q) for run, q in zip(runs, before)]


def _bounded(change):
    return np.nan_to_num(np.clip(change, -DIVERGED, DIVERGED), nan=DIVERGED)


def _filtered(centre, s, cause, p):
    law, values = centre.problem.law, centre.values
    torque, shift = np.zeros_like(s.q), None
    for piece in cause.pieces:
        if piece.port == "load":
            torque = torque - piece.act(s, [], p)[0]
        elif piece.port == "friction":
            forward, backward = piece.act(s, p)
            torque = torque - np.where(s.dq > 0, forward, -np.asarray(backward))
        elif piece.port == "drive":
            torque = torque + piece.act(s.u, [], p, s.h)[0] - s.u
        else:
            shift = piece.act(s.q, [], p, s.h)[0] - s.q
    filtered = []
    for k in range(torque.shape[1]):
        joint = law, k, values["inertia"][k], values["damping"][k]
        filtered.append(lfilter(*torque_sensitivity(*joint), torque[:, k]) if shift is None
                        else lfilter(*sensor_sensitivity(*joint), shift[:, k]))
    return np.stack(filtered, axis=1)
