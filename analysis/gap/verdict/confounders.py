"""What outside the library would move the robot just as a hypothesis does, in these logs.

A ripple, a spring with a weight, a fault that sets in: each has a mark of its own, by which it is
known.  Where the logs do not show the mark, something foreign moves the robot alike, and the
verdict asks more of the name.
"""

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TORQUE_RIPPLE
from clie_blocks.analysis.gap.causes.timed import STEP_FAULT

SOFT_STOP, CONTACT = "soft stop", "contact"
BENT = frozenset({"spring", "gravity"})  # torques of the pose that bend, together, like any other
SYNCHRONOUS = 0.9  # waves per motor turn from which one wave over the travel is enough
TWICE = 2.0  # waves of what is slower than the motor: it must come back to be called periodic
FAIR = 0.1  # of the size at the joint that has most of it: below, a joint is idle
YIELDS = 2e-3  # of the travel: what yields more shows by a torque that grows with the depth
PLACES = 1000  # of each kind that are compared


def confounder(fit):
    """Return the foreign effect that these logs do not tell from a fitted hypothesis.

    Parameters
    ----------
    fit : Fit
        The hypothesis.

    Returns
    -------
    str
        ``soft stop`` for a ripple of which the travel shows less than a wave, and for a spring
        beside a weight: torques of the pose that may stand for any other.  ``contact`` for a
        fault that sets in where the robot comes to a place at which it is at no other time, and
        stays: something in its way would push back alike.  Otherwise empty.

    """
    at = fit.hypothesis
    if any(member.cause in STEP_FAULT and _in_the_way(at, member) for member in at.members):
        return CONTACT
    bent = {member.cause.name for member in at.members} >= BENT
    bump = any(member.cause is TORQUE_RIPPLE and not _shows_waves(at, member)
               for member in at.members)
    return SOFT_STOP if bent or bump else ""


def _shows_waves(at, member):
    """Whether the travel of an acting joint shows enough waves to be called a ripple.

    Cogging and commutation come at least once per motor turn, and one wave of them over the
    travel is enough.
    """
    problem, joints = at.problem, list(member.joints)
    course = np.concatenate([log.q for log in problem.fit])
    typical = np.concatenate([log.u for log in problem.fit]).std(axis=0)[joints] + 1e-12
    sine, cosine, order = (at.values[f"{member.name}.{name}"][joints]
                           for name in ("sine", "cosine", "order"))
    enough = np.where(order >= SYNCHRONOUS * problem.gear_ratio[joints], 1.0, TWICE)
    waves = order * np.ptp(course, axis=0)[joints] >= 2 * np.pi * enough
    return bool(np.any(waves & _acting(np.hypot(sine, cosine) / typical)))


def _in_the_way(at, member):
    """Whether the fault sets in at places where the robot is at no other time, and pushes back."""
    number, joints = member.cause.numbers[0].name, np.array(member.joints)
    size, typical = (np.broadcast_to(sizes, at.problem.n)[joints] for sizes in (
        at.values[f"{member.name}.{number}"], member.sizes[number]))
    acting = joints[_acting(size / typical)]
    moments = at.values[f"{member.name}.onset"][:, acting].min(axis=1)
    pushed = np.zeros(at.problem.n)
    if member.cause.variant == "torque":
        pushed[acting] = size[_acting(size / typical)]
    travel = np.ptp(np.concatenate([log.q for log in at.problem.logs]), axis=0) + 1e-12
    return are_separable(*_places(at.problem, moments, travel), pushed / travel)


def _acting(size):
    """Which joints have a fair share of the largest size among them."""
    return np.abs(size) >= FAIR * np.abs(size).max()


def _places(problem, moments, travel):
    """Places with the fault, and without it, shares of the travel, thinned out."""
    kinds = [], []
    for log, moment in zip(problem.logs, moments):
        ill = np.arange(len(log)) * problem.period >= moment
        for places, which in zip(kinds, (ill, ~ill)):
            places.append(log.q[which] / travel)
    return [_thin(np.concatenate(places)) for places in kinds]


def _thin(places):
    """Some of many places, those at both ends of each joint's way among them."""
    if len(places) <= PLACES:
        return places
    ends = np.concatenate([places.argmin(axis=0), places.argmax(axis=0)])
    return places[np.union1d(np.linspace(0, len(places) - 1, PLACES).astype(int), ends)]


def are_separable(ill, well, pushed):
    """Whether a plane parts the places of two kinds.

    Parameters
    ----------
    ill, well : ndarray, shape (N, n)
        Places with and without a torque, shares of the travel.
    pushed : ndarray, shape (n,)
        Torque that opposes each joint, per travel; the plane is one that pushes back so.  All
        zero for any plane.

    Returns
    -------
    bool
        True where all of `ill` lie on one side and all of `well` on the other, but for what the
        thing in the way may yield.

    """
    ways = [(k, way) for k, push in enumerate(pushed) for way in (1.0, -1.0)
            if push * way > 0.0 or not pushed.any()]
    return bool(len(ill) and len(well)) and any(
        _margin(ill, well, pushed, k, way) >= -YIELDS for k, way in ways)


def _margin(ill, well, pushed, k, way):
    """Largest distance by which a plane of slope `way` in joint k, no steeper in others, parts."""
    if len(pushed) == 1:
        return np.min(way * ill) - np.max(way * well)
    from scipy.optimize import linprog

    def row(places, *bounds):
        return np.c_[places, np.tile(bounds, (len(places), 1))]

    sides = np.r_[row(-ill, 1.0, 0.0), row(well, 0.0, -1.0), row(-pushed[None, :], 0.0, 0.0)]
    slopes = [(way, way) if i == k else (-1.0, 1.0) for i in range(len(pushed))]
    found = linprog(np.r_[np.zeros(len(pushed)), -1.0, 1.0], sides, np.zeros(len(sides)),
                    bounds=[*slopes, (None, None), (None, None)])
    return -found.fun if found.success else -np.inf
