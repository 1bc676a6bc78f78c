"""The search for causes: one alone, then two and three at once, while much is left."""

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.fitting.refinement import prune_joints
from clie_blocks.analysis.gap.method.calibration import Calibration, load_calibration
from clie_blocks.analysis.gap.search.alternatives import alternatives
from clie_blocks.analysis.gap.search.candidates import extensions, pairs, singles
from clie_blocks.analysis.gap.search.racing import (
    ENOUGH,
    pairs_worth_fitting,
    predicted_excess,
    pruning_limit,
    race,
    worth_extending,
)
from clie_blocks.analysis.gap.search.screening import screen_causes, screen_residual

LEADERS = 8
MOST_CAUSES = 3  # at once
ROUNDS = 3  # of look-alikes of the best, which may be one of them
SMALL = Calibration().misfit  # share of the excess that a right model may leave
HOPELESS = 0.3  # share that a pair may leave of all, or a third cause of that, to be looked for


def search_causes(bench, base, causes=CAUSES, small=SMALL):
    """Fit the leading single causes, then pairs and triples while much is left.

    Parameters
    ----------
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.
    causes : sequence of Cause
        What to look for.
    small : float
        Share of the excess below which, too, no second cause is looked for: none could outweigh
        what it costs.

    Returns
    -------
    list of Fit
        All hypotheses that were fitted.

    """
    found = screen_causes(bench, base, causes)
    alone = singles(found, bench, base, causes)[:LEADERS]
    fits = _with_alternatives(bench, base, race(bench, base, alone, LEADERS // 2), causes)
    if _is_explained(fits, base, small) or len(causes) == 1:
        return fits
    chosen = pairs_worth_fitting(pairs(found)[:LEADERS // 2], alone, fits, base)
    firsts = _near_the_best(sorted(fits, key=lambda f: f.total)[:3], base)
    for first in firsts:
        more = _with_one_more_cause(found, bench, first, causes)
        chosen += [one for one in more if worth_extending(one, base)]
    fits = _with_alternatives(bench, base, fits + race(bench, base, _distinct(chosen), 3), causes)
    best = min(fits, key=lambda f: f.total)
    if (_is_explained(fits, base, small) or len(best.hypothesis.members) >= MOST_CAUSES
            or best in firsts):
        return fits
    thirds = _with_one_more_cause(found, bench, best, causes)
    least = min(map(predicted_excess, thirds), default=excess(best))
    if excess(best) > HOPELESS * excess(base) and least > HOPELESS * excess(best):
        return fits
    return _with_alternatives(bench, base, fits + race(bench, base, thirds, 2), causes)


def _is_explained(fits, base, small):
    """Whether the best fit leaves so little that no further cause could lead beside it."""
    least, nothing = min(map(excess, fits)), excess(base)
    return least < max(ENOUGH, small * nothing) or load_calibration().cannot_pay_off(least, nothing)


def _with_alternatives(bench, base, fits, causes):
    """Fits whose leaders, if they are good, lose idle joints, with the look-alikes of the best."""
    good = [one for one in fits if excess(one) < HOPELESS * excess(base)]
    leaders = _near_the_best(sorted(good, key=excess)[:2], base)
    freed = [prune_joints(one, bench, excess(base)) for one in leaders]
    fits = [one for one in fits if one not in leaders] + freed
    tried = []
    for _ in range(ROUNDS):
        alike = alternatives(min(fits, key=excess), fits, causes, bench, tried)
        fits = fits + race(bench, base, alike, 4)
        tried += alike
    return fits


def _near_the_best(fits, base):
    """Those of some fits that are not far behind the best of them."""
    far = pruning_limit(min(map(excess, fits), default=0.0), excess(base))
    return [one for one in fits if excess(one) < far]


def _with_one_more_cause(found, bench, first, causes):
    """Candidates that add to a fit one of the causes that explain most of what it leaves."""
    left = screen_residual(found, bench, first)
    return list(extensions(first, singles(left, bench, first, causes)[:8]))[:5]


def _distinct(candidates):
    seen = {}
    for candidate in candidates:
        key = frozenset(member.cause.key for member in candidate.members)
        seen.setdefault(key, candidate)
    return list(seen.values())
