"""What outside the library would move the robot just as a hypothesis does, in these logs.

A ripple, a spring with a weight, a fault that sets in: each has a mark of its own, by which it is
known.  Where the logs do not show the mark, something outside the library would move the robot in
the same way, and the verdict asks more of the name.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.drive import (
    COMMUTATION_RIPPLE,
    GEAR_MESH_RIPPLE,
    TORQUE_RIPPLE,
    counts_motor_turns,
)
from clie_blocks.analysis.gap.causes.friction import POSITION_DEPENDENT_FRICTION
from clie_blocks.analysis.gap.causes.timed import STEP_FAULT
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import block_means
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.marks import acting, causes_without_marks

POSE, CONTACT, UNMARKED = "torque of the pose", "contact", "unmarked"
_ANY_TORQUE = frozenset({"spring", "gravity"})  # together they imitate any torque of the pose
_RIPPLES = (TORQUE_RIPPLE, COMMUTATION_RIPPLE, GEAR_MESH_RIPPLE, POSITION_DEPENDENT_FRICTION)
_PASSING = 0.1  # s over which positions are averaged, so that their noise is no motion
_MOST_POSITIONS = 1000  # of each kind that are compared


def confounder(fit: Fit, residuals: ResidualModel) -> str:
    """Return the effect outside the library that these logs do not tell from a fitted hypothesis.

    Returns
    -------
    str
        ``torque of the pose`` for a ripple of which the travel shows less than a wave, and for a
        spring with a weight: torques of the pose that may stand for any other.  ``contact`` for a
        fault that sets in where the robot comes to a position at which it is at no other time, and
        stays: an obstacle there would push back in the same way.  ``unmarked`` for an effect of
        which the logs do not show the mark, see `marks`: it may have absorbed a part of anything.
        Otherwise empty.

    """
    return next((kind for kind, names in _imitations(fit, residuals) if names), "")


def imitated_causes(fit: Fit, residuals: ResidualModel) -> tuple[str, ...]:
    """Names of the causes of a fitted hypothesis in whose place its confounder may be."""
    return next((names for _, names in _imitations(fit, residuals) if names), ())


def _imitations(fit: Fit, residuals: ResidualModel) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Each confounder, and the causes in whose place it may be; none where the logs tell."""
    hypothesis, method = fit.hypothesis, residuals.method.verdict
    yield CONTACT, tuple(member.cause.name for member in hypothesis.members
                         if member.cause in STEP_FAULT
                         and _may_be_contact(hypothesis, member, method))
    any_torque = {member.cause.name for member in hypothesis.members} >= _ANY_TORQUE
    single_bumps = tuple(member.cause.name for member in hypothesis.members
                         if member.cause in _RIPPLES
                         and not _shows_waves(hypothesis, member, method))
    yield POSE, (*(sorted(_ANY_TORQUE) if any_torque else ()), *single_bumps)
    yield UNMARKED, causes_without_marks(fit, residuals)


def _shows_waves(hypothesis: Hypothesis, ripple: Member, method: VerdictMethod) -> bool:
    """Whether the travel of an acting joint shows enough waves to be called a ripple.

    Cogging and commutation come at least once per motor turn, and one wave of them over the
    travel is enough, as it is of a friction that is uneven.  Where the motor's turns are not
    known, waves of a torque must repeat.
    """
    problem, joints = hypothesis.problem, list(ripple.joints)
    course = np.concatenate([log.q for log in problem.fit])
    torque = np.concatenate([log.u for log in problem.fit]).std(axis=0)[joints] + 1e-12
    typical = 1.0 if ripple.cause is COMMUTATION_RIPPLE else torque  # a share of the command
    sine, cosine, order = (hypothesis.values[f"{ripple.name}.{name}"][joints]
                           for name in ("sine", "cosine", "order"))
    ratio = problem.gear_ratio[joints]
    is_synchronous = ((order >= method.synchronous_order * ratio)
                      & np.array([counts_motor_turns(each) for each in ratio]))
    enough = np.where(is_synchronous | (ripple.cause is POSITION_DEPENDENT_FRICTION), 1.0,
                      method.repeated_waves)
    if ripple.cause is POSITION_DEPENDENT_FRICTION and not np.any(
            _passes(problem)[joints] >= method.least_passes):
        return False
    has_waves = order * np.ptp(course, axis=0)[joints] >= 2 * np.pi * enough
    return bool(np.any(has_waves & acting(np.hypot(sine, cosine) / typical, method)))


def _passes(problem: Problem) -> np.ndarray:
    """How often each joint has gone over its travel in all logs, shape (n,)."""
    width = max(1, round(_PASSING / problem.period))
    courses = [block_means(log.q, width) for log in problem.law_logs]
    path = sum(np.abs(np.diff(course, axis=0)).sum(axis=0) for course in courses)
    return np.asarray(path / (np.ptp(np.concatenate(courses), axis=0) + 1e-12))


def _may_be_contact(hypothesis: Hypothesis, fault: Member, method: VerdictMethod) -> bool:
    """Whether the fault pushes back, and sets in at positions where the robot is only then."""
    problem, amplitude = hypothesis.problem, fault.cause.numbers[0].name
    joints = np.array(fault.joints)
    size, typical = (np.broadcast_to(sizes, problem.n)[joints] for sizes in (
        hypothesis.values[f"{fault.name}.{amplitude}"], fault.sizes[amplitude]))
    is_acting = acting(size / typical, method)
    faulty = joints[is_acting]
    onsets = hypothesis.values[f"{fault.name}.onset"][:, faulty].min(axis=1)
    opposing = np.zeros(problem.n)
    if fault.cause.variant == "torque":
        opposing[faulty] = size[is_acting]
    travel = np.ptp(np.concatenate([log.q for log in problem.logs]), axis=0) + 1e-12
    with_fault, without = _positions_by_fault(problem, onsets, travel)
    return are_separable(with_fault, without, opposing / travel, method.yielding)


def _positions_by_fault(problem: Problem, onsets: Sequence[float] | np.ndarray,
                        travel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions with the fault, and without it, in shares of the travel, thinned out."""
    with_fault, without = [], []
    for log, onset in zip(problem.law_logs, onsets):
        is_after = np.arange(len(log)) * problem.period >= onset
        with_fault.append(log.q[is_after] / travel)
        without.append(log.q[~is_after] / travel)
    return _thinned(np.concatenate(with_fault)), _thinned(np.concatenate(without))


def _thinned(positions: np.ndarray) -> np.ndarray:
    """Some of many positions, the extremes of each joint among them."""
    if len(positions) <= _MOST_POSITIONS:
        return positions
    extremes = np.concatenate([positions.argmin(axis=0), positions.argmax(axis=0)])
    even = np.linspace(0, len(positions) - 1, _MOST_POSITIONS).astype(int)
    return positions[np.union1d(even, extremes)]


def are_separable(with_torque: np.ndarray, without: np.ndarray, opposing: np.ndarray,
                  tolerance: float) -> bool:
    """Whether a plane separates the positions with a torque from those without it.

    Parameters
    ----------
    with_torque, without : ndarray, shape (N, n)
        Positions, in shares of the travel.
    opposing : ndarray, shape (n,)
        Torque that opposes each joint, per travel; the plane must be one that pushes back in
        this way.  All zero for any plane.
    tolerance : float
        By how much the two may overlap, in shares of the travel.

    """
    sides = [(k, slope) for k, push in enumerate(opposing) for slope in (1.0, -1.0)
             if push * slope > 0.0 or not opposing.any()]
    return bool(len(with_torque) and len(without)) and any(
        _margin(with_torque, without, opposing, k, slope) >= -tolerance for k, slope in sides)


def _margin(with_torque: np.ndarray, without: np.ndarray, opposing: np.ndarray, k: int,
            slope: float) -> float:
    """Largest distance between two sets along a plane of slope +-1 in joint k, flatter elsewhere.

    It is negative where the sets overlap.
    """
    if len(opposing) == 1:
        return float(np.min(slope * with_torque) - np.max(slope * without))
    from scipy.optimize import linprog

    def row(points: np.ndarray, *bounds: float) -> np.ndarray:
        return np.c_[points, np.tile(bounds, (len(points), 1))]

    limits = np.r_[row(-with_torque, 1.0, 0.0), row(without, 0.0, -1.0),
                   row(-opposing[None, :], 0.0, 0.0)]
    slopes = [(slope, slope) if i == k else (-1.0, 1.0) for i in range(len(opposing))]
    plane = linprog(np.r_[np.zeros(len(opposing)), -1.0, 1.0], limits, np.zeros(len(limits)),
                    bounds=[*slopes, (None, None), (None, None)])
    return -plane.fun if plane.success else -np.inf
