"""The race of candidates: all that compete begin, the best are fitted to the end."""

import numpy as np

from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess, fit
from clie_blocks.analysis.gap.search.events import refit_event_times

FAR = 10.0  # times the excess of the best: what stays so far behind it is not fitted further
LITTLE = 0.05  # share of an excess that its promises do not resolve
FAVOURITES = 2  # of the screening that are fitted to the end, while much is left, slow or not
STEPS, PATIENCE = 8, 24  # of a finalist's fit, and more of the leader's where it still moves
WORTH = 0.8  # share of what a fit leaves that another cause beside it may leave, to be begun
MOST = 0.5  # share of the excess of the nominal model that two causes and more may leave
BENT = 0.5  # times the best promise of a cause alone: a fit below says that promises mean nothing
QUIET = 0.1  # excess per sample of a robot that nothing ails
ENOUGH = 0.4  # excess per sample below which no second cause is looked for


def race(bench, base, candidates, finalists):
    """Fit candidates for a few steps, then the best of them, and the favourites, to the end."""
    begun = _started(bench, base, candidates)
    order = sorted(begun, key=lambda f: f.total)
    leaders = [one.after for one in candidates if _is_alternative(one)]
    within = min(map(excess, order[:1] + leaders), default=0.0)
    far = pruning_limit(within, excess(base) if leaders else 0.0)
    last = [f for f in order[:finalists] if excess(f) < far]
    slow = not leaders and within > LITTLE * excess(base)
    last += [f for f in begun[:FAVOURITES if slow else 0] if f not in last]
    done = sorted((fit(f.hypothesis, bench, STEPS) for f in last), key=lambda f: f.total)
    done[:1] = [fit(f.hypothesis, bench, PATIENCE) if _is_moving(f) else f for f in done[:1]]
    return [_with_event_times(f, bench, base) for f in done] + [f for f in order if f not in last]


def _with_event_times(found, bench, base):
    """Fit with its moments and phases found anew, unless it has explained too little for a cause.

    Moments that the screening missed cost a right fault less than what a wrong one leaves.
    """
    told = _training_excess(found) < WORTH * _training_excess(base)
    return refit_event_times(found, bench) if told else found


def _is_alternative(candidate):
    """Whether a candidate is a look-alike of a fit, or a part of it, rather than an extension."""
    return candidate.after is not None and candidate.score == 0.0


def _is_part(candidate):
    """Whether a candidate is a fit without one of its causes."""
    return _is_alternative(candidate) and {member.cause for member in candidate.members} < {
        member.cause for member in candidate.after.hypothesis.members}


def pruning_limit(best, nothing):
    """Excess beyond which nothing is fitted further: far behind the best, and much of all.

    What a part of a fit leaves says what the rest of it removes, so little is told exactly.

    Parameters
    ----------
    best, nothing : float
        Excess of the best fit, and of the refitted nominal model.

    """
    return max(FAR * max(best, ENOUGH), LITTLE * nothing)


def _started(bench, base, candidates):
    """First steps of the candidates that compete, those that promise most first."""
    begun = []
    for candidate in sorted(candidates, key=predicted_excess):
        if not begun or _can_compete(candidate, min(begun, key=_training_excess)):
            begun.append(_first_steps(candidate, bench, base))
    return begun


def _first_steps(candidate, bench, base):
    """Fit after two steps; as it starts, where a part of the leader proves to be far too little.

    A part starts with the leader's numbers; where other look-alikes start says nothing.
    """
    start = initial_guess(candidate, bench, base)
    if _is_part(candidate):
        plain = fit(start, bench, 0)
        if _training_excess(plain) > pruning_limit(_training_excess(candidate.after), _training_excess(base)):
            return plain
    return fit(start, bench, 2)


def _can_compete(candidate, best):
    """Whether a candidate may come near the best fit: as promised, or with a cause of that one.

    Promises are linear: what they leave of a large excess is blurred.
    """
    shared = candidate.members[-1].cause in [member.cause for member in best.hypothesis.members]
    if shared or candidate.after is None:
        return True
    blur = LITTLE * _training_excess(candidate.after)
    return predicted_excess(candidate) < FAR * max(_training_excess(best), QUIET) + blur


def predicted_excess(candidate):
    """Excess that a candidate promises to leave beside the fit that it extends.

    What a further cause promises beside a fit is nearly what it does.  Beside the nominal model,
    which a large effect has bent, it promises too little, and look-alikes promise nothing.
    """
    if candidate.after is None or _is_alternative(candidate):
        return -np.inf
    return _training_excess(candidate.after, candidate.score)


def worth_extending(candidate, base):
    """Whether a further cause promises to explain a fair share of what the fit before it leaves.

    A cause that is there promises half of it and more; many that are not there promise a little.
    Together the causes must promise most of what there is: something unknown leaves less.
    Of a link that moves apart from its motor the screening knows too little to promise.

    Parameters
    ----------
    candidate : Candidate
        Extends a fit.
    base : Fit
        The refitted nominal model.

    """
    left, new = _training_excess(candidate.after), candidate.members[-1].cause
    if left > QUIET and any(piece.port == "transmission" for piece in new.pieces):
        return True
    return left > QUIET and predicted_excess(candidate) < min(WORTH * left, MOST * _training_excess(base))


def pairs_worth_fitting(pairs, alone, fits, base):
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
    best = min(fits, key=_training_excess)
    reached = _training_excess(best)
    if reached < BENT * min(_training_excess(base, one.score) for one in alone):
        leading = {member.cause for member in best.hypothesis.members}
        return [pair for pair in pairs if leading.isdisjoint(m.cause for m in pair.members)]
    return [pair for pair in pairs
            if _training_excess(base, pair.score) < min(reached, MOST * _training_excess(base))]


def _training_excess(found, gain=0.0):
    """Excess of a fit on the logs that it learned from, after a gain."""
    samples = found.samples[:len(found.hypothesis.problem.fit)]
    return (found.cost - gain) / samples.sum(axis=0).mean() - samples.shape[1]


def _is_moving(found):
    """Whether the fit of a finalist ended for want of steps, away from the floor."""
    return found.iterations == STEPS and excess(found) > QUIET
