"""From the evidence to probabilities, sets and one verdict.

The model of the evidence.  A true cause leaves next to nothing, and what it does leave is misfit,
not noise: so the odds of a hypothesis follow the logarithm of the excess that it leaves
(`Calibration.score`) rather than chi^2 itself.  From that score it pays

    parameter_cost        for each parameter that it spends,
    cause_cost            for each cause after the first, and more if that removes little,
    prior_violation_cost  if it leaves the joint model outside its datasheet,
    confounder_cost       if something outside the library would move the robot as it does.

Three hypotheses hold no cause.  ``none`` leaves what the refitted nominal model leaves beyond
`healthy`.  ``parametric`` is that model without the price of its parameters beyond the datasheet,
or with another number of the robot file, see `causes.description`, whatever does better; the
same stands beside causes.
``unknown`` leaves a fixed share of all, or what a free torque of pose, speed and load leaves of
the likeliest hypothesis, of the best or of the best single cause; or it is the confounder of a
hypothesis.  Where many causes explain most of the gap, it stands beside those that it is not taken
for.  With probability `contamination` all this is wrong, and the odds are less sharp.
"""

import dataclasses
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.description import PARAMETRIC
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.verdict.confounders import POSE
from clie_blocks.analysis.gap.verdict.evidence import Row, Table

NONE, UNKNOWN = "none", "unknown"
LIKELY = 0.5  # probability from which on a name is an answer: more likely than not
SET_PROBABILITY = 0.9  # of a credible set
_IMITATING = 2  # causes of the library at most, that one unknown effect is taken for

# Why nothing explains a gap, where the stages know.
MODEL_DIVERGED, NOT_BORNE_OUT, COMMANDS_UNCLEAR = "diverged", "not_borne_out", "commands_unclear"


@dataclasses.dataclass(frozen=True, eq=False)
class RankedCause:
    """One hypothesis in the ranking.

    Parameters
    ----------
    names : tuple of str
        Its causes, or ('none',), ('unknown',) or ('parametric',); the last two also beside causes.
    fit : Fit or None
        The fit, if it has one.
    excess : float
        chi^2 beyond the noise, per sample of one joint, with the price of its parameters.
    probability : float
        Posterior probability.

    """

    names: tuple[str, ...]
    fit: Fit | None
    excess: float
    probability: float


class _Scored(NamedTuple):
    """What a hypothesis leaves, and the logarithm of its odds but for a constant [nats]."""

    excess: float
    score: float


_Hypothesis = tuple[tuple[str, ...], Fit | None, _Scored]
"""Names, fit, and score."""


def posterior(table: Table, calibration: Calibration) -> list[RankedCause]:
    """Rank the hypotheses, the nominal model, `unknown` and `parametric`, most probable first.

    The probabilities sum to one.
    """
    joint_model = _parametric(table, calibration)
    table = _with_wrong_joint_models(table, calibration)
    without_cause = [((NONE,), table.nominal, _none(table, calibration)),
                     *_unknown(table, calibration)]
    causes = [(row.names, row.fit, _Scored(row.excess, score))
              for row, score in zip(table.rows, _cause_scores(table, calibration))]
    best_number = max((scored.score for names, _, scored in causes if names == (PARAMETRIC,)),
                      default=-np.inf)
    if table.prior_violations and joint_model.score > best_number:
        without_cause.append(((PARAMETRIC,), table.nominal, joint_model))
        causes = [one for one in causes if one[0] != (PARAMETRIC,)]
    hypotheses = without_cause + causes
    scores = np.array([scored.score for *_, scored in hypotheses])
    sharp, blunt = _odds(scores), _odds(scores / calibration.contamination_bluntness)
    weights = (1.0 - calibration.contamination) * sharp + calibration.contamination * blunt
    first = len(without_cause)
    weights[first:] = _less_sure(weights[first:], scores[first:], table, calibration)
    ranking = [RankedCause(names, fit, scored.excess, float(weight))
               for (names, fit, scored), weight in zip(hypotheses, weights)]
    return sorted(ranking, key=lambda ranked: -ranked.probability)


def _odds(scores: np.ndarray) -> np.ndarray:
    """Probabilities whose logarithms differ as the scores do."""
    weights = np.exp(scores - scores.max())
    return weights / weights.sum()


def _none(table: Table, c: Calibration) -> _Scored:
    """The nominal model: what it leaves beyond that of a healthy robot, and its violations."""
    return _Scored(table.nominal_excess, c.score_of_none(
        table.nominal_excess, table.prior_violation, table.prior_violations))


def _parametric(table: Table, c: Calibration) -> _Scored:
    """The nominal model with parameters beyond the datasheet.

    It leaves no less than a cause that keeps to the datasheet with fewer parameters.
    """
    plain = table.nominal_excess - table.prior_violation
    better = [row.excess for row in table.rows if not row.confounder
              and row.prior_violations == 0 and row.parameter_count < table.prior_violations]
    left = max(_beyond_healthy(table, c), min(plain, min(better, default=0.0)))
    return _Scored(plain, c.score(left, table.nominal_excess)
                   - c.parameter_cost * table.prior_violations - c.parametric_cost)


def _with_wrong_joint_models(table: Table, c: Calibration) -> Table:
    """Evidence with causes beside a joint model that is stated wrong.

    Such a hypothesis speaks of the parameters beyond the datasheet: it spends them, like any
    number of the file, and their distance from the datasheet is no part of what it leaves.  Where
    another number of the file stands beside the same causes, the better of the two stays.
    """
    rows: dict[tuple[tuple[str, ...], str], Row] = {}
    misdescribed = [_with_wrong_joint_model(row) for row in table.rows
                    if row.prior_violations and not row.confounder and PARAMETRIC not in row.names]
    for row in table.rows + misdescribed:
        key = row.names, row.confounder
        rows[key] = max(rows.get(key, row), row, key=lambda one: c.score(
            one.excess, table.nominal_excess) - _parameter_cost(one, c))
    return dataclasses.replace(table, rows=list(rows.values()))


def _with_wrong_joint_model(row: Row) -> Row:
    return dataclasses.replace(
        row, names=tuple(sorted((*row.names, PARAMETRIC))),
        excess=row.excess - row.prior_violation, prior_violation=0.0,
        parameter_count=row.parameter_count + row.prior_violations, prior_violations=0)


def _beyond_healthy(table: Table, c: Calibration) -> float:
    return max(table.nominal_excess - table.prior_violation - c.healthy, 0.0)


def _cause_scores(table: Table, c: Calibration) -> list[float]:
    """Score of each hypothesis with causes."""
    against_confounder = c.free_torque_cost + c.confounder_cost
    return [c.score(row.excess, table.nominal_excess) - _cost(row, table, c)
            - against_confounder * bool(row.confounder) for row in table.rows]


def _cost(row: Row, table: Table, c: Calibration) -> float:
    """Cost of a hypothesis: its parameters, and its causes after the first [nats]."""
    cost = _parameter_cost(row, c) + c.wrong_number_cost * (PARAMETRIC in row.names)
    if len(row.names) == 1:
        return cost
    fewer = [other for other in table.rows
             if not other.confounder and set(other.names) < set(row.names)]
    without = min((other.excess for other in fewer), default=table.nominal_excess)
    gap = min((other.excess - other.prior_violation for other in fewer), default=without)
    gain = (without - row.excess) / table.nominal_excess
    return (cost + c.cause_cost * (len(row.names) - 1) + c.shortfall(gain)
            + c.gained_in_health(row.excess, gap, table.nominal_excess))


def _parameter_cost(row: Row, c: Calibration) -> float:
    """Cost of the parameters of a hypothesis, and of those of its joint model [nats]."""
    violation = c.prior_violation_cost * bool(row.prior_violations)
    return c.parameter_cost * row.parameter_count + violation


def _unknown(table: Table, c: Calibration) -> list[_Hypothesis]:
    """Something unknown, alone or beside causes: what it leaves, by the strongest sign of it."""
    left = max(c.unexplained_share * table.nominal_excess, c.unexplained_least)
    by_share = (UNKNOWN,), None, _Scored(left, c.score(left, table.nominal_excess))
    strongest: dict[tuple[str, ...], _Hypothesis] = {}
    for sign in (by_share, *_confounded(table, c), *_free_torques(table, c)):
        names, _, scored = sign
        if names not in strongest or scored.score > strongest[names][2].score:
            strongest[names] = sign
    return list(strongest.values())


def _confounded(table: Table, c: Calibration) -> Iterator[_Hypothesis]:
    """Confounders: one unknown effect each, which two causes may imitate.

    Beside that there are the other causes of a larger set.  They keep their names where they
    alone, or some of them, leave less than an unknown effect would.
    """
    most = c.unexplained_share * table.nominal_excess
    known = sorted((row for row in table.rows if not row.confounder and row.excess < most),
                   key=lambda row: (-len(row.names), row.excess))
    for row in table.rows:
        if row.confounder:
            least = c.pose_torque_share * table.nominal_excess * (row.confounder == POSE)
            left = max(row.excess, least)
            beside = c.cause_cost * max(len(row.names) - _IMITATING, 0)
            scored = _Scored(left, c.score(left, table.nominal_excess) - c.free_torque_cost
                             - _parameter_cost(row, c) - beside)
            others = tuple(name for name in row.names if name not in row.imitated)
            part = next((one for one in known if {*one.names} <= {*others}), None)
            if len(row.names) > _IMITATING and part is not None:
                fit = part.fit if part.names == others else None
                yield tuple(sorted((*others, UNKNOWN))), fit, scored
            else:
                yield (UNKNOWN,), None, scored


def _free_torques(table: Table, c: Calibration) -> Iterator[_Hypothesis]:
    """Free torques that explain much of what a hypothesis leaves.

    One is compared with the likeliest hypothesis, one with the best, one with the best single
    cause.
    """
    if not table.free:
        return
    cost = {row: _cost(row, table, c) for row in table.rows if not row.confounder}
    score = {row: c.score(row.excess, table.nominal_excess) for row in cost}
    likeliest = max(cost, key=lambda row: score[row] - cost[row])
    best = min(cost, key=lambda row: row.excess)
    singles = [row for row in cost if len(row.names) == 1] or list(cost)
    single = min(singles, key=lambda row: row.excess)
    slack = c.floor + c.free_torque_slack * table.nominal_excess
    for left, row, paid in zip(table.free, (likeliest, best, single), (0.0, cost[best], 0.0)):
        if left < c.free_torque_share * row.excess:
            gain = c.sharpness * np.log((row.excess + slack) / (max(left, 0.0) + slack))
            yield (UNKNOWN,), None, _Scored(
                left, score[row] - c.free_torque_cost - paid + gain)


def _less_sure(weights: np.ndarray, scores: np.ndarray, table: Table, c: Calibration,
               ) -> np.ndarray:
    """The causes' probabilities, with less for the leading one where even that leaves much.

    Then all models are off, and what they leave hardly distinguishes them.
    """
    least = min((row.excess for row in table.rows), default=0.0)
    left = max(least - c.healthy, 0.0)
    most = 1.0 - c.leader_uncertainty * left / (left + c.unexplained_least)
    if len(weights) < 2 or weights.max() <= most:
        return weights
    is_leading = np.arange(len(weights)) == np.argmax(weights)
    others = (weights.max() - most) * _odds(np.where(is_leading, -np.inf, scores))
    return np.where(is_leading, most, weights + others)


def marginals(ranking: Sequence[RankedCause]) -> dict[str, float]:
    """Probability of each cause, over all hypotheses that hold it, most probable first."""
    probability: dict[str, float] = {}
    for ranked in ranking:
        for name in ranked.names:
            probability[name] = probability.get(name, 0.0) + ranked.probability
    return dict(sorted(probability.items(), key=lambda item: -item[1]))


def of_known(ranking: Sequence[RankedCause]) -> list[RankedCause]:
    """Ranking without `unknown`, whose probability goes to the others."""
    known = [ranked for ranked in ranking if ranked.names != (UNKNOWN,)]
    held = sum(ranked.probability for ranked in known)
    return [dataclasses.replace(ranked, probability=ranked.probability / held)
            for ranked in known]


def probability_of_any(ranking: Sequence[RankedCause], names: Collection[str]) -> float:
    """Probability of the hypotheses that hold one or more of some names."""
    return float(sum(ranked.probability for ranked in ranking if {*ranked.names} & {*names}))


def credible_set(ranking: Sequence[RankedCause]) -> list[str]:
    """Smallest set of names that holds nine tenths of the probability."""
    names: list[str] = []
    held = 0.0
    for ranked in ranking:
        if held >= SET_PROBABILITY:
            break
        names += [name for name in ranked.names if name not in names]
        held += ranked.probability
    return names


def verdict(ranking: Sequence[RankedCause], established: bool = False,
            alike: Sequence[Sequence[str]] = ()) -> str:
    """One word: effect, parametric, none, unexplained or not_identifiable.

    The last one says that these logs cannot tell: no name, with those that are `alike`, holds
    half of the probability, or the only name is alike with one of another kind.
    `established` says that the check of the controller alone found a cause.
    """
    if established:
        return "effect"
    leading = min(ranking[0].names, key=lambda name: (name != UNKNOWN, name == PARAMETRIC))
    of_name = marginals(ranking)
    together = [probability_of_any(ranking, names) for names in alike]
    if leading != UNKNOWN and max([*of_name.values(), *together]) < LIKELY:
        return "not_identifiable"
    kinds = {name if name in (NONE, PARAMETRIC) else "" for names in alike for name in names}
    if len(ranking[0].names) == 1 and len(kinds) > 1:
        return "not_identifiable"
    words = {NONE: "none", UNKNOWN: "unexplained", PARAMETRIC: "parametric"}
    return words.get(leading, "effect")


def unknown_for_none(ranking: Sequence[RankedCause]) -> list[RankedCause]:
    """Ranking of a robot whose gains are not the stated ones, with the law that ran.

    With the gains that ran nothing else may be left to explain; but then there is something, and
    no effect of the library is it: what would go to `none` goes to `unknown`.
    """
    moved = sum(ranked.probability for ranked in ranking if ranked.names == (NONE,))
    change: dict[tuple[str, ...], float] = {(NONE,): -moved, (UNKNOWN,): moved}
    changed = [dataclasses.replace(ranked, probability=ranked.probability
                                   + change.get(ranked.names, 0.0)) for ranked in ranking]
    return sorted(changed, key=lambda ranked: -ranked.probability)


def doubted(ranking: Sequence[RankedCause], sure: float) -> list[RankedCause]:
    """Ranking where a probability `sure` that it holds at all scales every name but `unknown`.

    The rest goes to `unknown`: something that the model of the evidence does not know.
    """
    if sure >= 1.0:
        return list(ranking)
    moved = sum((1.0 - sure) * one.probability for one in ranking if one.names != (UNKNOWN,))
    changed = [dataclasses.replace(one, probability=one.probability + moved
                                   if one.names == (UNKNOWN,) else sure * one.probability)
               for one in ranking]
    return sorted(changed, key=lambda one: -one.probability)


def of_unfinished_search(ranking: Sequence[RankedCause], sure: float) -> list[RankedCause]:
    """Ranking where the right causes are among what was fitted with a probability `sure` only.

    Of several causes most are right all the same: a set that explains more, and was not fitted,
    has something else in the place of one of them.  So each makes room for `unknown` in turn.
    """
    probability: dict[tuple[str, ...], float] = {}
    likeliest: dict[tuple[str, ...], RankedCause] = {}
    for one in ranking:
        likeliest.setdefault(one.names, one)
        missed = (1.0 - sure) * one.probability * (one.names != (UNKNOWN,))
        probability[one.names] = probability.get(one.names, 0.0) + one.probability - missed
        known = [name for name in one.names if name != UNKNOWN]
        for name in known:
            others = tuple(sorted({*one.names, UNKNOWN} - {name}))
            probability[others] = probability.get(others, 0.0) + missed / len(known)
    changed = [dataclasses.replace(likeliest[names], probability=share) if names in likeliest
               else RankedCause(names, None, np.nan, share)
               for names, share in probability.items()]
    return sorted(changed, key=lambda one: -one.probability)


def certainty_of_unfinished(ranking: Sequence[RankedCause], nominal_excess: float, method: Method,
                            ) -> float:
    """Probability that the leading causes are the right ones, where the search had to stop.

    The less they leave beside what is worth a name, the less likely are others that were not
    fitted; some that explain as much may still be among them.
    """
    excess = next(one.excess for one in ranking if UNKNOWN not in one.names)
    worth = method.calibration.fair_share * max(nominal_excess, method.calibration.healthy)
    explained = worth / (worth + max(excess, 0.0))
    least, most = method.verdict.unfinished_search, method.verdict.unfinished_but_explained
    return least + (most - least) * explained
