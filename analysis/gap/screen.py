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
from clie_blocks.analysis.gap.hypothesis import Member
from clie_blocks.analysis.gap.noise import white
from clie_blocks.analysis.gap.response import base_motion, responses
from clie_blocks.analysis.gap.slopes import tangent


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


def screen(bench, base, causes=CAUSES):
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
    rows, residual = tangent(base, bench)
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
                raw = np.stack([_stacked(bench, change, k) for change in changes], axis=1)
                columns.append(Column(cause, number, member, k, probe.amplitudes, raw,
                                      _freed(raw, basis)))
    target = [_freed(left, basis) for basis, left in zip(bases, residual)]
    return Screen(columns, target, len(rows[0]) - rows[0].shape[1])


def _freed(x, basis):
    """Signal (or columns) without what the nuisances explain, with rows for their prior."""
    padded = np.zeros((len(basis), *x.shape[1:]))
    padded[:len(x)] = x
    return padded - basis @ (basis.T @ padded)


def _active(probe):
    """Numbers of a probe with one of its amplitudes at a time, the others at zero."""
    return [{name: value if active in (None, name) or name not in probe.amplitudes
             else 0.0 * value for name, value in probe.values.items()}
            for active in probe.amplitudes or (None,)]


def _stacked(bench, errors, k):
    return np.concatenate([bench.projected(white(error[:, k], bench.noises[k].whitener), j, k)
                           for j, error in enumerate(errors)])


def rescreened(found, bench, after):
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
    rows, residual = tangent(after, bench)
    columns, target = [], []
    for k in range(bench.problem.n):
        basis = np.linalg.qr(rows[k])[0]
        target.append(_freed(residual[k], basis))
        columns += [dataclasses.replace(c, data=_freed(c.raw, basis))
                    for c in found.columns if c.joint == k]
    return Screen(columns, target, found.samples)
