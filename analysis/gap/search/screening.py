"""Screening: what each cause could explain at each joint, by regression on simulated columns.

A column is the change of the predicted motion when a cause is switched on at a small (or, for
causes without an amplitude, at a definite) size, whitened and freed from everything that inertia,
damping, offset and an unknown initial state could do as well.  The regression is then closed-loop
output error, linearised; fits by full simulation follow for the leaders.
"""

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause, Probe, Scene
from clie_blocks.analysis.gap.fitting.compile_ahead import compile_ahead, compile_here
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    Values,
    build_hypothesis,
)
from clie_blocks.analysis.gap.fitting.jacobian import joint_columns
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import Rows, block_means, rows_of, whiten
from clie_blocks.analysis.gap.residual.whitening import DIVERGED, JointModel, ResidualModel
from clie_blocks.analysis.gap.simulation.batch_runs import WIDE
from clie_blocks.analysis.theory.sampled_loop import decimated_filter
from clie_blocks.linear_filters import lfilter
from clie_blocks.processors import side_by_side
from clie_blocks.robot_loop.dynamics import State

_MANY_TICKS = 8  # of the controller in a row, of which every other one is enough
_TORQUE_PORTS = frozenset(("load", "friction", "drive"))


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
        The cause at all joints with the probe's parameters.
    joint : int
        Joint.
    amplitudes : tuple of str
        Parameters that the columns scale; empty for one column of coefficient one.
    raw : ndarray, shape (N, columns)
        Whitened, on the fit logs.
    data : ndarray, shape (N + parameters, columns)
        Without what fitted parameters explain, with a row below for the prior of each.

    """

    cause: Cause
    probe: int
    member: Member
    joint: int
    amplitudes: tuple[str, ...]
    raw: np.ndarray
    data: np.ndarray

    @property
    def size(self) -> int:
        """Number of parameters that the column set spends."""
        free = sum(not number.fixed for number in self.cause.numbers)
        return max(len(self.amplitudes), free)

    @functools.cached_property
    def limits(self) -> np.ndarray:
        """Bounds of the coefficients, shape (2, amplitudes): the cause's over the probe's."""
        numbers = {number.name: number for number in self.cause.numbers}
        bounds = np.array([(numbers[name].lower, numbers[name].upper)
                           for name in self.amplitudes]).reshape(-1, 2).T
        sizes = [np.ravel(self.member.values[name])[self.joint] for name in self.amplitudes]
        return bounds / np.array(sizes)


@dataclasses.dataclass(frozen=True, eq=False)
class Screen:
    """Outcome of a screening.

    Parameters
    ----------
    columns : list of Column
        All columns.
    target : list of ndarray
        Whitened error of each joint without what fitted parameters explain, rows as those of the
        columns.
    samples : int
        Rows of data per joint.

    """

    columns: list[Column]
    target: list[np.ndarray]
    samples: int

    @property
    def parameter_price(self) -> float:
        """What one parameter costs in chi^2, as in BIC."""
        return np.log(self.samples * len(self.target))


def scene(problem: Problem, hypothesis: JointModel, motion: Sequence[State]) -> Scene:
    """Sizes of the nominal motion, from which probes choose their grids."""
    u = np.concatenate([log.u for log in problem.fit])
    q = np.concatenate([log.q for log in problem.fit])
    speeds = np.concatenate([state.dq for state in motion])
    commands = np.concatenate([state.u for state in motion])
    return Scene(problem, torque=np.sqrt((u**2).mean(axis=0)),
                 speed=np.sqrt((speeds**2).mean(axis=0)), travel=np.ptp(q, axis=0) + 1e-9,
                 peak_torque=np.abs(u).max(axis=0) + 1e-12,
                 inertia=hypothesis.values["inertia"], u=commands, dq=speeds)


def screen_causes(residuals: ResidualModel, nominal: Fit, causes: Sequence[Cause] = CAUSES,
                  ) -> Screen:
    """Find the columns of every cause around the refitted nominal model."""
    centre = nominal.hypothesis
    motion = base_motion(centre)
    fitted, target = joint_columns(nominal, residuals)
    bases = [np.linalg.qr(own)[0] for own in fitted]
    sizes = scene(residuals.problem, centre, motion)
    columns, possible = [], [cause for cause in causes
                             if residuals.problem.links.known or not cause.needs_links]
    compile_ahead(_with_cause(centre, cause, probe.values) for cause in possible
                  if _filter_of(cause) is None for probe in cause.probes(sizes)[:1])
    for cause in possible:
        columns += _columns_of_cause(cause, residuals, centre, motion, sizes, bases)
    return Screen(columns, [unexplained(left, basis) for basis, left in zip(bases, target)],
                  len(fitted[0]) - fitted[0].shape[1])


def _columns_of_cause(cause: Cause, residuals: ResidualModel, centre: Hypothesis,
                      motion: list[State], sizes: Scene, bases: list[np.ndarray]) -> list[Column]:
    probes = cause.probes(sizes)
    variants = [_one_amplitude_at_a_time(probe) for probe in probes]
    changes = responses(centre, motion, cause, [values for some in variants for values in some])
    columns = []
    for number, (probe, some) in enumerate(zip(probes, variants)):
        of_probe = [next(changes) for _ in some]
        member = Member(cause, tuple(range(residuals.problem.n)), probe.values,
                        {**probe.values, **probe.sizes})
        for k, basis in enumerate(bases):
            raw = np.stack([_whitened(residuals, change, k) for change in of_probe], axis=1)
            columns.append(Column(cause, number, member, k, probe.amplitudes, raw,
                                  unexplained(raw, basis)))
    return columns


def _one_amplitude_at_a_time(probe: Probe) -> list[Values]:
    """Parameters of a probe with one of its amplitudes at a time, the others at zero."""
    if not probe.amplitudes:
        return [dict(probe.values)]
    return [{name: 0.0 * value if name in probe.amplitudes and name != active else value
             for name, value in probe.values.items()} for active in probe.amplitudes]


def unexplained(x: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Signal (or columns) less what a basis explains, with rows below for the prior."""
    padded = np.zeros((len(basis), *x.shape[1:]))
    padded[:len(x)] = x
    return padded - basis @ (basis.T @ padded)


def _whitened(residuals: ResidualModel, changes: Sequence[np.ndarray], k: int) -> np.ndarray:
    """Whitened changes (N, n) of the position of joint k, log by log."""
    return np.concatenate([
        residuals.without_initial_response(
            whiten(change[:, k], residuals.noise(j, k).whitener), j, k)
        for j, change in enumerate(changes)])


def screen_residual(screen: Screen, residuals: ResidualModel, fit: Fit) -> Screen:
    """Return a screening, with the same columns, of what a fit leaves.

    The parameters of its causes, too, now explain what they can.
    """
    fitted, target = joint_columns(fit, residuals)
    columns, remaining = [], []
    for k in range(residuals.problem.n):
        basis = np.linalg.qr(fitted[k])[0]
        remaining.append(unexplained(target[k], basis))
        columns += [dataclasses.replace(column, data=unexplained(column.raw, basis))
                    for column in screen.columns if column.joint == k]
    return Screen(columns, remaining, screen.samples)


def base_motion(hypothesis: Hypothesis) -> list[State]:
    """States of a hypothesis along each fit log as its encoder sees them, shape (N, n)."""
    problem, states = hypothesis.problem, []
    for j, log in enumerate(problem.fit):
        q, u = hypothesis.simulator.run(log, hypothesis.of_log(j))
        time = problem.period * np.arange(len(log))[:, None]
        states.append(State(q, np.gradient(q, problem.period, axis=0), u, time, problem.period,
                            problem.links, problem.gear_ratio))
    return states


def responses(hypothesis: Hypothesis, motion: list[State], cause: Cause, sets: list[Values],
              ) -> Iterator[list[np.ndarray]]:
    """Yield the changes of the measured positions when a cause is switched on.

    For each set of parameters one decimated change per fit log, around a hypothesis without the
    cause that has a `base_motion`.  They are made one by one, since all of them are gigabytes on
    an arm of many joints.
    """
    if not sets:
        return
    moved = _filter_of(cause)
    if moved is not None:
        for values in sets:
            yield [moved(hypothesis, state, rows, cause, _of_log(values, run), log)
                   for state, rows, run, log in zip(
                       motion, _rows(hypothesis.problem), hypothesis.problem.runs,
                       hypothesis.problem.fit)]
    else:
        yield from _simulated(hypothesis, motion, cause, sets)


def _filter_of(cause: Cause) -> Callable[..., np.ndarray] | None:
    """How a cause moves the positions through a filter; None where it must be simulated."""
    ports = [piece.port for piece in cause.pieces]
    if any(piece.states for piece in cause.pieces):
        return None
    if set(ports) <= _TORQUE_PORTS:
        return _moved_by_torques
    return _moved_by_sensor if ports == ["sensor"] else None


def _rows(problem: Problem) -> list[Rows]:
    """Rows in which each log to fit is compared."""
    return [rows_of(log, problem.period) for log in problem.fit]


def _of_log(values: Values, run: int) -> Values:
    return {name: value[run] if np.ndim(value) == 2 else value for name, value in values.items()}


def _simulated(hypothesis: Hypothesis, motion: list[State], cause: Cause, sets: list[Values],
               ) -> Iterator[list[np.ndarray]]:
    """The changes by full simulation, for causes with a memory or inside the dynamics."""
    problem = hypothesis.problem
    variants = [_with_cause(hypothesis, cause, values) for values in sets]
    compile_here(variants[0])
    before = [rows.of_samples(state.q) for state, rows in zip(motion, _rows(problem))]
    for first in range(0, len(variants), WIDE):
        group = variants[first:first + WIDE]
        values = [variant.values for variant in group]
        runs = side_by_side(functools.partial(group[0].means, sets=values), range(len(motion)),
                            group[0].simulator.threads)
        for i in range(len(group)):
            yield [_bounded(run[i].T - q) for run, q in zip(runs, before)]


def _with_cause(hypothesis: Hypothesis, cause: Cause, values: Values) -> Hypothesis:
    """Hypothesis with a further cause at all joints."""
    member = Member(cause, tuple(range(hypothesis.problem.n)), values, values)
    return build_hypothesis(hypothesis.problem, (*hypothesis.members, member), hypothesis)


def _bounded(change: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.clip(change, -DIVERGED, DIVERGED), nan=DIVERGED)


def _moved_by_torques(hypothesis: Hypothesis, state: State, rows: Rows, cause: Cause, p: Values,
                      log: Log) -> np.ndarray:
    """Change of the rows (N, n) of the positions in a log, from torques through S.

    The loop moves little within a row of many ticks, so that the torque's mean over it decides,
    and that is taken over half of them.  Both encoders see it.
    """
    law, values = hypothesis.problem.law, hypothesis.values
    filters = [law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
               for k in range(state.q.shape[1])]
    if rows.ticks < _MANY_TICKS or rows.ticks % 2:
        torque = _torque(state, cause, p)
        return rows.of_samples(np.stack(
            [lfilter(*each, of_joint) for each, of_joint in zip(filters, torque.T)], axis=1))
    few = slice(None, len(log) // rows.ticks * rows.ticks, 2)
    torque = _torque(dataclasses.replace(
        state, q=state.q[few], dq=state.dq[few], u=state.u[few], t=np.asarray(state.t)[few]),
        cause, p)
    means = block_means(torque, rows.ticks // 2)
    return np.stack([lfilter(*decimated_filter(*each, rows.ticks, rows.stride), mean)
                     for each, mean in zip(filters, means.T)], axis=1)


def _torque(state: State, cause: Cause, p: Values) -> np.ndarray:
    """Torque (N, n) that a cause adds along a motion."""
    torque = np.zeros_like(state.q)
    for piece in cause.pieces:
        if piece.port == "load":
            torque = torque - piece.act(state, [], p)[0]
        elif piece.port == "friction":
            (forward, backward), _ = piece.act(state, [], p)
            torque = torque - np.where(state.dq > 0, forward, -np.asarray(backward))
        elif piece.port == "drive":
            torque = torque + piece.act(state, [], p)[0] - state.u
    return torque


def _moved_by_sensor(hypothesis: Hypothesis, state: State, rows: Rows, cause: Cause, p: Values,
                     log: Log) -> np.ndarray:
    """Change of the rows (N, n) of the positions in a log, from an error of a sensor through S.

    A joint that follows an error of the law's encoder moves by (S - 1) times that error.
    """
    problem, law, values = hypothesis.problem, hypothesis.problem.law, hypothesis.values
    (piece,) = cause.pieces
    shift = piece.act(state, [], p)[0] - state.q
    if problem.two_encoders and problem.encoder_on_motor and piece.of_link:  # unseen by the law
        return rows.of_samples(shift if log.of_other_encoder else 0.0 * shift)
    moved = np.stack([lfilter(*law.sensor_sensitivity(
        k, values["inertia"][k], values["damping"][k]), of_joint)
        for k, of_joint in enumerate(shift.T)], axis=1)
    return rows.of_samples(moved - float(log.of_other_encoder) * shift)
