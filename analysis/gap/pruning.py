"""A cause that does nothing at a joint is left out there."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.fit import fit

USELESS, USELESS_SHARE = 0.05, 0.002  # rise of the excess that a joint left out may cause
CLEAR = 10.0  # times that rise foreseen: then no fit need show it
NEAR = 0.01  # share of the whole excess that a fit may leave for its slopes to be believed


def pruned(found, bench, nothing):
    """Leave out joints at which a cause of a fit does no more than noise.

    Parameters
    ----------
    found : Fit
        A fitted hypothesis.
    bench : Bench
        Whitening.
    nothing : float
        Excess of the refitted nominal model.

    """
    if found not in bench.freed:
        freed = _freed(found, bench, nothing)
        bench.freed[found] = bench.freed[freed] = freed
    return bench.freed[found]


def _freed(found, bench, nothing):
    for place, member in enumerate(found.hypothesis.members):
        if member.cause.shared or len(member.joints) == 1:
            continue
        for k in member.joints:
            rise = USELESS + USELESS_SHARE * nothing
            near = excess(found) < USELESS + NEAR * nothing
            if near and _foreseen(found, place, k) > CLEAR * rise:
                continue
            fewer = _without(found.hypothesis, place, k)
            tried = None if fewer is None else fit(fewer, bench, 3)
            if tried and excess(tried) - excess(found) < rise:
                found = tried
    return found


def _foreseen(found, place, k):
    """Rise of the excess that the slopes of a fit foresee where a joint loses a cause."""
    at = found.hypothesis
    member = at.members[place]
    neutral = {f"{member.name}.{number.name}": number.neutral for number in member.cause.numbers
               if number.neutral is not None}
    mine = [i for i, entry in enumerate(at.open) if entry.key in neutral and entry.joint == k]
    away = np.array([at.get(at.open[i]) - neutral[at.open[i].key] for i in mine])
    known = np.linalg.pinv(found.covariance[np.ix_(mine, mine)], hermitian=True)
    return away @ known @ away / (found.samples.sum() / at.problem.n)


def _without(at, place, k):
    member = at.members[place]
    joints = tuple(j for j in member.joints if j != k)
    if not joints:
        return None
    values = dict(at.values)
    for number in member.cause.numbers:
        key = f"{member.name}.{number.name}"
        if number.neutral is not None:
            values[key] = values[key].copy()
            values[key][..., k] = number.neutral
    members = list(at.members)
    members[place] = dataclasses.replace(member, joints=joints)
    return dataclasses.replace(at, members=tuple(members), values=values)
