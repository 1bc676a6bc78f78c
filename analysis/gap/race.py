"""The race of candidates: all that compete begin, the best are fitted to the end."""

import numpy as np

from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.fit import fit
from clie_blocks.analysis.gap.settling import settled
from clie_blocks.analysis.gap.start import started

FAR = 10.0  # times the excess of the best: what stays so far behind it is not fitted further
LITTLE = 0.05  # share of the excess of the nominal model, below which a look-alike goes on
FAVOURITES = 2  # candidates of the screening that are fitted to the end, slow starters or not
STEPS, PATIENCE = 8, 24  # of a finalist's fit, and more of the leader's where it still moves
WORTH = 0.8  # share of what a fit leaves that another cause beside it may leave, to be begun
BENT = 0.5  # times the best promise of a cause alone: a fit below says that promises mean nothing
QUIET = 0.1  # excess per sample of a robot that nothing ails
ENOUGH = 0.4  # excess per sample below which no second cause is looked for


def race(bench, base, candidates, finalists):
    """Fit candidates for a few steps, then the best of them, and the favourites, to the end."""
    begun = _begun(bench, base, candidates)
    order = sorted(begun, key=lambda f: f.total)
    leaders = [one.after for one in candidates if _alike(one)]
    within = min(map(excess, order[:1] + leaders), default=0.0)
    far = reach(within, excess(base) if leaders else 0.0)
    last = [f for f in order[:finalists] if excess(f) < far]
    last += [f for f in begun[:0 if leaders else FAVOURITES] if f not in last]
    done = sorted((fit(f.hypothesis, bench, STEPS) for f in last), key=lambda f: f.total)
    done[:1] = [fit(f.hypothesis, bench, PATIENCE) if _moving(f) else f for f in done[:1]]
    return [settled(f, bench) for f in done] + [f for f in order if f not in last]


def _alike(candidate):
    """Whether a candidate is a look-alike of a fit, or a part of it, rather than an extension."""
    return candidate.after is not None and candidate.score == 0.0


def reach(best, nothing):
    """Excess beyond which nothing is fitted further: far behind the best, and much of all.

    What a part of a fit leaves says what the rest of it removes, so little is told exactly.

    Parameters
    ----------
    best, nothing : float
        Excess of the best fit, and of the refitted nominal model.

    """
    return max(FAR * max(best, ENOUGH), LITTLE * nothing)


def _begun(bench, base, candidates):
    """First steps of the candidates that compete, those that promise most first."""
    begun = []
    for candidate in sorted(candidates, key=promised):
        if not begun or _competes(candidate, min(begun, key=_learned)):
            begun.append(_first_steps(candidate, bench, base))
    return begun


def _first_steps(candidate, bench, base):
    """Fit after two steps; as it starts, where a look-alike of the leader proves to be none."""
    start = started(candidate, bench, base)
    if _alike(candidate):
        plain = fit(start, bench, 0)
        if _learned(plain) > reach(_learned(candidate.after), _learned(base)):
            return plain
    return fit(start, bench, 2)


def _competes(candidate, best):
    """Whether a candidate may come near the best fit: as promised, or with a cause of that one."""
    shared = candidate.members[-1].cause in [member.cause for member in best.hypothesis.members]
    return shared or promised(candidate) < FAR * max(_learned(best), QUIET)


def promised(candidate):
    """Excess that a candidate promises to leave beside the fit that it extends.

    What a further cause promises beside a fit is nearly what it does.  Beside the nominal model,
    which a large effect has bent, it promises too little, and look-alikes promise nothing.
    """
    if candidate.after is None or _alike(candidate):
        return -np.inf
    return _learned(candidate.after, candidate.score)


def promising(candidate):
    """Whether a further cause promises to explain a fair share of what the fit before it leaves.

    A cause that is there promises half of it and more; many that are not there promise a little.
    """
    left = _learned(candidate.after)
    return left > QUIET and promised(candidate) < WORTH * left


def believed(pairs, alone, fits, base):
    """Return the pairs that promise more than what the best single cause has reached.

    Where that does far better than any had promised, the nominal model is too bent for promises.
    Then all are returned but those that hold its cause: what another one adds, its own fit tells.

    Parameters
    ----------
    pairs, alone : list of Candidate
        Two causes, and one, beside the nominal model.
    fits : list of Fit
        What the single causes have come to.
    base : Fit
        The refitted nominal model.

    """
    best = min(fits, key=_learned)
    reached = _learned(best)
    if reached < BENT * min(_learned(base, one.score) for one in alone):
        leading = {member.cause for member in best.hypothesis.members}
        return [pair for pair in pairs if leading.isdisjoint(m.cause for m in pair.members)]
    return [pair for pair in pairs if _learned(base, pair.score) < reached]


def _learned(found, gain=0.0):
    """Excess of a fit on the logs that it learned from, after a gain."""
    samples = found.samples[:len(found.hypothesis.problem.fit)]
    return (found.cost - gain) / samples.sum(axis=0).mean() - samples.shape[1]


def _moving(found):
    """Whether the fit of a finalist ended for want of steps, away from the floor."""
    return found.iterations == STEPS and excess(found) > QUIET
