"""A cause that does nothing at a joint is left out there."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.fit import fit, foreseen
from clie_blocks.analysis.gap.slopes import linearised

USELESS, USELESS_SHARE = 0.05, 0.002  # rise of the excess that a joint left out may cause
CLEAR = 10.0  # times that rise foreseen: then no fit need show it
SURE = 3.0  # times that rise promised without the joint: then no fit need show it either
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
        rise = USELESS + USELESS_SHARE * nothing
        near = excess(found) < USELESS + NEAR * nothing
        foreseen = {k: _foreseen(found, place, k) for k in member.joints}
        idle = [k for k in foreseen if foreseen[k] < rise]
        if near and 1 < len(idle) < len(foreseen):
            found = _tried(found, place, idle, bench, rise * len(idle))
        for k in found.hypothesis.members[place].joints:
            if not near or foreseen[k] < CLEAR * rise:
                found = _tried(found, place, [k], bench, rise)
    return found


def _tried(found, place, joints, bench, rise):
    """Fit with a cause left out at some joints, if the excess rises by less; else the same."""
    fewer = _without(found.hypothesis, place, joints)
    if fewer is None or _promised(fewer, found, bench) > SURE * rise:
        return found
    tried = fit(fewer, bench, 3)
    return tried if excess(tried) - excess(found) < rise else found


def _promised(fewer, found, bench):
    """Rise of the excess on the fit logs that the slopes of a start promise to its fit."""
    here, samples = linearised(fewer, bench), found.samples[:len(fewer.problem.fit)]
    left = here.cost - foreseen(fewer, here)
    return (left - found.cost) / (samples.sum() / fewer.problem.n)


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


def _without(at, place, left_out):
    member = at.members[place]
    joints = tuple(k for k in member.joints if k not in left_out)
    if not joints:
        return None
    values = dict(at.values)
    for number in member.cause.numbers:
        key = f"{member.name}.{number.name}"
        if number.neutral is not None:
            values[key] = values[key].copy()
            values[key][..., list(left_out)] = number.neutral
    members = list(at.members)
    members[place] = dataclasses.replace(member, joints=joints)
    return dataclasses.replace(at, members=tuple(members), values=values)
