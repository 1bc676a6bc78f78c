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
from clie_blocks.analysis.gap.fit import tangent
from clie_blocks.analysis.gap.hypothesis import Member, hypothesis


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
    data : ndarray, shape (N, columns)
        Whitened, on the fit logs, without the nuisances.

    """

    cause: object
    probe: int
    member: Member
    joint: int
    amplitudes: tuple
    data: np.ndarray

    @property
    def size(self):
        """Numbers that the column set spends."""
        free = sum(not number.fixed for number in self.cause.numbers)
        return max(len(self.amplitudes), free)

    @functools.cached_property
    def lower(self):
        """Lower bounds of the amplitudes: 0 or none."""
        bounds = {number.name: number.lower for number in self.cause.numbers}
        return np.array([0.0 if bounds[name] >= 0.0 else -np.inf for name in self.amplitudes])


@dataclasses.dataclass(frozen=True, eq=False)
class Screen:
    """Outcome of a screening.

    Parameters
    ----------
    columns : list of Column
        All columns.
    target : list of ndarray
        Whitened error of each joint without the nuisances.
    samples : int
        Rows per joint.

    """

    columns: list
    target: list
    samples: int


def scene(problem, base):
    """Sizes of the base motion, from which probes choose their grids."""
    u = np.concatenate([log.u for log in problem.fit])
    q = np.concatenate([log.q for log in problem.fit])
    runs = [base.simulator.run(log, base.of_log(j))[0] for j, log in enumerate(problem.fit)]
    rates = np.concatenate([np.diff(run, axis=0) / problem.period for run in runs])
    quantiles = np.abs(u)
    return Scene(problem, torque=np.sqrt((u**2).mean(axis=0)),
                 speed=np.sqrt((rates**2).mean(axis=0)), travel=np.ptp(q, axis=0) + 1e-9,
                 torque_quantiles=lambda levels: np.quantile(quantiles, levels, axis=0),
                 inertia=base.values["inertia"])


def screen(bench, base, causes=CAUSES):
    """Simulate the columns of every cause around a fitted base.

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
    plain = [centre.error(j) for j in range(len(problem.fit))]
    nuisance = _nuisance(bench, centre, plain)
    look = scene(problem, centre)
    columns = []
    for cause in causes:
        for number, probe in enumerate(cause.probes(look)):
            columns += _columns(bench, centre, plain, nuisance, cause, number, probe)
    target = [nuisance[k](_stacked(bench, plain, k)) for k in range(problem.n)]
    return Screen(columns, target, len(target[0]))


def _columns(bench, centre, plain, nuisance, cause, number, probe):
    problem = bench.problem
    joints = tuple(range(problem.n))
    changes = []
    for active in probe.amplitudes or (None,):
        values = {name: value if active in (None, name) or name not in probe.amplitudes
                  else 0.0 * value for name, value in probe.values.items()}
        member = Member(cause, joints, values, probe.values)
        trial = hypothesis(problem, (*centre.members, member), centre)
        changes.append([plain[j] - trial.error(j) for j in range(len(problem.fit))])
    member = Member(cause, joints, probe.values, probe.values)
    found = []
    for k in joints:
        data = np.stack([_stacked(bench, change, k) for change in changes], axis=1)
        data = nuisance[k](data)
        found.append(Column(cause, number, member, k, probe.amplitudes, data))
    return found


def _stacked(bench, errors, k):
    return np.concatenate([bench.projected(_white(bench, error[:, k], k), j, k)
                           for j, error in enumerate(errors)])


def _white(bench, error, k):
    from clie_blocks.analysis.gap.noise import decimated, white

    return white(decimated(error, bench.problem.period), bench.noises[k].whitener)


def _nuisance(bench, centre, plain):
    """Per joint, the map that takes away what the joint model can do, within its tolerances."""
    n = bench.problem.n
    maps = []
    moved = {}
    for name in ("inertia", "damping", "load"):
        entries = [entry for entry in centre.open if entry.key == name]
        values = centre.moved([(e, centre.get(e) + 0.3 * e.size) for e in entries])
        chosen = centre.with_values(values)
        moved[name] = ([chosen.error(j) for j in range(len(plain))], entries)
    for k in range(n):
        columns = []
        for name, (errors, entries) in moved.items():
            change = [now - then for now, then in zip(errors, plain)]
            column = _stacked(bench, change, k) / 0.3
            entry = entries[k]
            loose = entry.tolerance is None
            columns.append((column, 0.0 if loose else entry.size / entry.tolerance))
        rows = np.stack([column for column, _ in columns], axis=1)
        prior = np.diag([weight for _, weight in columns])
        basis = np.linalg.qr(np.concatenate([rows, prior]))[0][:len(rows)]
        maps.append(lambda x, basis=basis: x - basis @ (basis.T @ x))
    return maps


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
        target.append(residual[k] - basis @ (basis.T @ residual[k]))
        columns += [dataclasses.replace(c, data=c.data - basis @ (basis.T @ c.data))
                    for c in found.columns if c.joint == k]
    return Screen(columns, target, found.samples)
