"""Screening: what each cause could explain at each joint, by regression on simulated columns.

A column is the change of the predicted motion when a cause is switched on at a small (or, for
causes without an amplitude, at a definite) size, whitened and freed from everything that inertia,
damping, offset and an unknown start could do as well.  The regression is then closed-loop output
error, linearised; a polish by full simulation follows for the leaders.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Scene
from clie_blocks.analysis.gap.fitting.hypothesis import Member, hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import joint_columns
from clie_blocks.analysis.gap.residual.noise import decimated, whiten
from clie_blocks.analysis.gap.residual.sensitivity import sensor_sensitivity, torque_sensitivity
from clie_blocks.analysis.gap.residual.whitening import DIVERGED
from clie_blocks.analysis.gap.simulation.batch_runs import WIDE
from clie_blocks.analysis.gap.simulation.dynamics import State
from clie_blocks.linear_filters import lfilter


@dataclasses.dataclass(frozen=True, eq=False)
class Column:
    """Columns of one probe at one joint.

    Parameters
    ----------
    cause : Cause
        The cause.
    probe : int
        Which of its probes.
    member : Member
        The cause at all joints with the probe's numbers.
    joint : int
        Joint.
    amplitudes : tuple of str
        Numbers that the columns scale; empty for one column of coefficient one.
    raw : ndarray, shape (N, columns)
        Whitened, on the fit logs.
    data : ndarray, shape (N + numbers, columns)
        Without the nuisances, with a row below for the prior of each.

    """

    cause: object
    probe: int
    member: Member
    joint: int
    amplitudes: tuple
    raw: np.ndarray
    data: np.ndarray

    @property
    def size(self):
        """Numbers that the column set spends."""
        free = sum(not number.fixed for number in self.cause.numbers)
        return max(len(self.amplitudes), free)

    @functools.cached_property
    def limits(self):
        """Bounds of the coefficients, shape (2, amplitudes): the cause's over the probe's."""
        numbers = {number.name: number for number in self.cause.numbers}
        sizes = [np.ravel(self.member.values[name])[self.joint] for name in self.amplitudes]
        return np.array([[bound(numbers[name]) / size
                          for name, size in zip(self.amplitudes, sizes)]
                         for bound in (lambda x: x.lower, lambda x: x.upper)])


@dataclasses.dataclass(frozen=True, eq=False)
class Screen:
    """Outcome of a screening.

    Parameters
    ----------
    columns : list of Column
        All columns.
    target : list of ndarray
        Whitened error of each joint without the nuisances, rows as those of the columns.
    samples : int
        Rows of data per joint.

    """

    columns: list
    target: list
    samples: int


def scene(problem, base, motion):
    """Sizes of the base motion, from which probes choose their grids."""
    u = np.concatenate([log.u for log in problem.fit])
    q = np.concatenate([log.q for log in problem.fit])
    rates = np.concatenate([s.dq for s in motion])
    return Scene(problem, torque=np.sqrt((u**2).mean(axis=0)),
                 speed=np.sqrt((rates**2).mean(axis=0)), travel=np.ptp(q, axis=0) + 1e-9,
                 peak_torque=np.abs(u).max(axis=0) + 1e-12,
                 inertia=base.values["inertia"])


def screen_causes(bench, base, causes=CAUSES):
    """Find the columns of every cause around a fitted base.

    Parameters
    ----------
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.
    causes : sequence of Cause
        What to look for.

    """
    problem, centre = bench.problem, base.hypothesis
    motion = base_motion(centre)
    rows, residual = joint_columns(base, bench)
    bases = [np.linalg.qr(own)[0] for own in rows]
    look = scene(problem, centre, motion)
    columns = []
    for cause in causes:
        if cause.needs_links and not problem.chain.known:
            continue
        probes = cause.probes(look)
        sets = [_active(probe) for probe in probes]
        found = iter(responses(centre, motion, cause, [one for own in sets for one in own])
                     if probes else ())
        for number, probe in enumerate(probes):
            changes = [next(found) for _ in sets[number]]
            member = Member(cause, tuple(range(problem.n)), probe.values,
                            {**probe.values, **probe.sizes})
            for k, basis in enumerate(bases):
                raw = np.stack([_stack(bench, change, k) for change in changes], axis=1)
                columns.append(Column(cause, number, member, k, probe.amplitudes, raw,
                                      _without_nominal(raw, basis)))
    target = [_without_nominal(left, basis) for basis, left in zip(bases, residual)]
    return Screen(columns, target, len(rows[0]) - rows[0].shape[1])


def _without_nominal(x, basis):
    """Signal (or columns) without what the nuisances explain, with rows for their prior."""
    padded = np.zeros((len(basis), *x.shape[1:]))
    padded[:len(x)] = x
    return padded - basis @ (basis.T @ padded)


def _active(probe):
    """Numbers of a probe with one of its amplitudes at a time, the others at zero."""
    return [{name: value if active in (None, name) or name not in probe.amplitudes
             else 0.0 * value for name, value in probe.values.items()}
            for active in probe.amplitudes or (None,)]


def _stack(bench, errors, k):
    return np.concatenate([bench.projected(whiten(error[:, k], bench.noises[k].whitener), j, k)
                           for j, error in enumerate(errors)])


def screen_residual(found, bench, after):
    """Return the screening for what a fitted hypothesis leaves, with the same columns.

    Parameters
    ----------
    found : Screen
        A screening around the refitted nominal model.
    bench : Bench
        Whitening.
    after : Fit
        A hypothesis whose numbers, too, are nuisances now.

    """
    rows, residual = joint_columns(after, bench)
    columns, target = [], []
    for k in range(bench.problem.n):
        basis = np.linalg.qr(rows[k])[0]
        target.append(_without_nominal(residual[k], basis))
        columns += [dataclasses.replace(c, data=_without_nominal(c.raw, basis))
                    for c in found.columns if c.joint == k]
    return Screen(columns, target, found.samples)


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
            yield [_within_bounds(run[i].T - q) for run, q in zip(runs, before)]


def _within_bounds(change):
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
