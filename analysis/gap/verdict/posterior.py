"""From fitted hypotheses to probabilities, sets and one verdict.

Each hypothesis is judged by the excess of its chi^2 over the noise, relative to the samples of one
joint.  A true cause leaves next to nothing; what it does leave is misfit, not noise, so the odds
follow the logarithm of the excess rather than chi^2 itself.  `none` wins where the refitted
nominal model leaves little, `unknown` where nothing in the library removes most of the excess, or
where a free torque of pose, speed and load removes much of what the best hypothesis leaves, or
the likeliest.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.verdict.confounders import SOFT_STOP

NONE, UNKNOWN, PARAMETRIC = "none", "unknown", "parametric"
LIKELY = 0.5  # probability from which on a name is an answer
HALF = 0.5  # of what a hypothesis leaves: a free torque must at least remove the other half


@dataclasses.dataclass(frozen=True, eq=False)
class RankedCause:
    """One hypothesis in the ranking.

    Parameters
    ----------
    names : tuple of str
        Causes, or ('none',) or ('unknown',).
    fit : Fit or None
        The fit, if it has one.
    excess : float
        chi^2 beyond the noise, per sample of one joint, with what its numbers cost.
    probability : float
        Posterior probability.

    """

    names: tuple
    fit: object
    excess: float
    probability: float


def posterior(table, calibration):
    """Rank the refitted nominal model, the hypotheses, `unknown`, and wrong numbers.

    Parameters
    ----------
    table : Table
        Hypotheses and what they leave.
    calibration : Calibration
        The numbers.

    Returns
    -------
    list of Standing
        Most probable first; probabilities sum to one.

    """
    c, nothing = calibration, table.nothing

    def score(value):
        return -c.sharpness * np.log(max(value, 0.0) + c.floor + c.misfit * max(nothing, 0.0))

    known = {row.names: row.excess for row in table.rows if not row.rival}
    plain = nothing - table.stray
    healthy = max(plain - c.healthy, 0.0)
    rows = [((NONE,), table.base, nothing,
             score(healthy + table.stray) - c.beyond * bool(table.strayed)),
            ((UNKNOWN,), None, *_unknown(table, score, known, c))]
    if table.strayed:
        rows.append(((PARAMETRIC,), table.base, plain, score(_prior_violation(table, plain, healthy))
                     - c.price * table.strayed - c.parametric))
    rows += [(row.names, row.fit, row.excess, score(row.excess) - _cost(row, known, nothing, c)
              - (c.structure + c.foreign) * bool(row.rival)) for row in table.rows]
    scores = np.array([row[3] for row in rows])
    weights = (1.0 - c.lapse) * _odds(scores) + c.lapse * _odds(scores / c.blunt)
    causes = slice(len(rows) - len(table.rows), None)
    weights[causes] = _contaminated(weights[causes], scores[causes], table, c)
    found = [RankedCause(*row[:3], float(weight)) for row, weight in zip(rows, weights)]
    return sorted(found, key=lambda standing: -standing.probability)


def _prior_violation(table, plain, healthy):
    """What wrong numbers leave: no less than a cause that brings them home with fewer numbers."""
    rivals = [row.excess for row in table.rows
              if not row.rival and row.strayed == 0 and row.numbers < table.strayed]
    return max(healthy, min(plain, min(rivals, default=0.0)))


def _contaminated(weights, scores, table, c):
    """The causes' probabilities, with less for the leading one where even that leaves much.

    Then all models are off, and by how much is a poor judge between them.
    """
    left = max(min((row.excess for row in table.rows), default=0.0) - c.healthy, 0.0)
    surest = 1.0 - c.doubt * left / (left + c.unexplained_least)
    if len(weights) < 2 or weights.max() <= surest:
        return weights
    leading = np.arange(len(weights)) == np.argmax(weights)
    others = (weights.max() - surest) * _odds(np.where(leading, -np.inf, scores))
    return np.where(leading, surest, weights + others)


def _odds(scores):
    """Probabilities whose logarithms differ as the scores do."""
    weights = np.exp(scores - scores.max())
    return weights / weights.sum()


def _unknown(table, score, known, c):
    """What something unknown leaves, and its score: by its share, or by its structure.

    A free torque shows the structure, and so does a hypothesis with a foreign rival: that is one
    thing, however many causes it takes to imitate it.
    """
    left = max(c.unexplained_share * table.nothing, c.unexplained_least)
    ways = [(left, score(left))]
    for row in table.rows:
        if row.rival:
            left = max(row.excess, c.alike * table.nothing * (row.rival == SOFT_STOP))
            ways.append((left, score(left) - c.structure - _parameter_cost(row, c)))
    if table.free:
        cost = {row: _cost(row, known, table.nothing, c) for row in table.rows if not row.rival}
        likeliest = max(cost, key=lambda row: score(row.excess) - cost[row])
        best, alone = (min(some, key=lambda row: row.excess) for some in (
            cost, [row for row in cost if len(row.names) == 1] or cost))
        slack = c.floor + c.slack * table.nothing
        ways += [(free, score(row.excess) - c.structure - paid
                  + c.sharpness * np.log((row.excess + slack) / (max(free, 0.0) + slack)))
                 for free, row, paid in zip(table.free, (likeliest, best, alone),
                                            (0.0, cost[best], 0.0))
                 if free < HALF * row.excess]
    return max(ways, key=lambda way: way[1])


def _cost(row, known, nothing, c):
    """What the numbers of a hypothesis, and its causes beyond the first, cost [nats]."""
    cost = _parameter_cost(row, c)
    if len(row.names) == 1:
        return cost
    fewer = [left for names, left in known.items() if set(names) < set(row.names)]
    gained = (min(fewer, default=nothing) - row.excess) / nothing
    return cost + c.second * (len(row.names) - 1) + c.small_gain_cost(gained)


def _parameter_cost(row, c):
    """What the numbers of a hypothesis cost, and those of its joint model [nats]."""
    return c.price * row.numbers + c.beyond * bool(row.strayed)


def marginals(ranking):
    """Probability of each cause, over all hypotheses that hold it."""
    found = {}
    for standing in ranking:
        for name in standing.names:
            found[name] = found.get(name, 0.0) + standing.probability
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def credible_set(ranking):
    """Smallest set of names that holds nine tenths of the probability."""
    names, reached = [], 0.0
    for standing in ranking:
        if reached >= 0.9:
            break
        names += [name for name in standing.names if name not in names]
        reached += standing.probability
    return names


def verdict(ranking, established=False):
    """One word: effect, parametric, none, unexplained or not_identifiable.

    The last one says that no name holds half of the probability: these logs cannot tell.

    Parameters
    ----------
    ranking : list of Standing
        From `weighed`.
    established : bool
        The controller check alone found a cause.

    """
    if established:
        return "effect"
    leading = ranking[0].names[0]
    if leading != UNKNOWN and max(marginals(ranking).values()) < LIKELY:
        return "not_identifiable"
    words = {NONE: "none", UNKNOWN: "unexplained", PARAMETRIC: "parametric"}
    return words.get(leading, "effect")


NOTHING_ALONE, UNKNOWN_ALONE = ("none",), ("unknown",)


def unknown_for_none(ranking):
    """Ranking of a robot whose gains are not the stated ones.

    With the gains that ran nothing else may be left to explain; but then there is something, and
    no effect of the library is it: what would go to `none` goes to `unknown`.

    Parameters
    ----------
    ranking : list of Standing
        From `weighed`, with the law that ran.

    """
    nothing = sum(s.probability for s in ranking if s.names == NOTHING_ALONE)
    moved = {NOTHING_ALONE: -nothing, UNKNOWN_ALONE: nothing}
    found = [dataclasses.replace(s, probability=s.probability + moved.get(s.names, 0.0))
             for s in ranking]
    return sorted(found, key=lambda standing: -standing.probability)
