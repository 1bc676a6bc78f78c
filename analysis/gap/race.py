"""The race of candidates: all that compete begin, the best are fitted to the end."""

import numpy as np

from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.fit import fit
from clie_blocks.analysis.gap.settling import settled
from clie_blocks.analysis.gap.start import started

FAR = 10.0  # times the excess of the best: what stays so far behind it is not fitted further
FAVOURITES = 2  # candidates of the screening that are fitted to the end, slow starters or not
STEPS, PATIENCE = 8, 24  # of a finalist's fit, and more of the leader's where it still moves
QUIET = 0.1  # excess per sample of a robot that nothing ails
ENOUGH = 0.4  # excess per sample below which no second cause is looked for


def race(bench, base, candidates, finalists):
    """Fit candidates for a few steps, then the best of them, and the favourites, to the end."""
    begun = _begun(bench, base, candidates)
    order = sorted(begun, key=lambda f: f.total)
    last = [f for f in order[:finalists] if excess(f) < FAR * max(excess(order[0]), ENOUGH)]
    last += [f for f in begun[:FAVOURITES] if f not in last]
    done = sorted((fit(f.hypothesis, bench, STEPS) for f in last), key=lambda f: f.total)
    done[:1] = [fit(f.hypothesis, bench, PATIENCE) if _moving(f) else f for f in done[:1]]
    return [settled(f, bench) for f in done] + [f for f in order if f not in last]


def _begun(bench, base, candidates):
    """First steps of the candidates that compete, those that promise most first."""
    begun = []
    for candidate in sorted(candidates, key=promised):
        if not begun or _competes(candidate, min(begun, key=_learned)):
            begun.append(fit(started(candidate, bench, base), bench, 2))
    return begun


def _competes(candidate, best):
    """Whether a candidate may come near the best fit: as promised, or with a cause of that one."""
    shared = candidate.members[-1].cause in [member.cause for member in best.hypothesis.members]
    return shared or promised(candidate) < FAR * max(_learned(best), QUIET)


def promised(candidate):
    """Excess that a candidate promises to leave beside the fit that it extends.

    What a further cause promises beside a fit is nearly what it does.  Beside the nominal model,
    which a large effect has bent, it promises too little, and look-alikes promise nothing.
    """
    if candidate.after is None or candidate.score == 0.0:
        return -np.inf
    return _learned(candidate.after, candidate.score)


def _learned(found, gain=0.0):
    """Excess of a fit on the logs that it learned from, after a gain."""
    samples = found.samples[:len(found.hypothesis.problem.fit)]
    return (found.cost - gain) / samples.sum(axis=0).mean() - samples.shape[1]


def _moving(found):
    """Whether the fit of a finalist ended for want of steps, away from the floor."""
    return found.iterations == STEPS and excess(found) > QUIET
