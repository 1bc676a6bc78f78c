"""What a verdict rests on: one row per hypothesis, in numbers that can be kept and read again.

The excess is chi^2 beyond the noise, per sample of one joint, with what the numbers cost.  Nothing
here depends on the calibration, so a table of many robots can be weighed anew in no time; which
pairs were fitted at all does, where a further cause is futile under the stored one.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.fitting.nesting import FAR, repeats_simulator, simpler_names
from clie_blocks.analysis.gap.fitting.prediction_error import gap
from clie_blocks.analysis.gap.verdict.confounders import confounder

STRAYED = 9.0  # squared sigmas beyond the datasheet that speak of a parametric mismatch
BEHIND = 20.0  # times the excess of the best: what leaves more has no odds to share,
SLIGHT, QUIET = 1e-3, 0.4  # and an excess of less than this share of all, or this, is all the same
MUCH = 0.5  # share of all: what leaves more has no odds against something unknown
SEARCHED = "onset"  # no fit moves it, but it was chosen among hundreds of moments


@dataclasses.dataclass(frozen=True, eq=False)
class Row:
    """One hypothesis with causes.

    Parameters
    ----------
    names : tuple of str
        Its causes, sorted.
    excess : float
        What it leaves, see `excess`.
    numbers : float
        Numbers that it spends beyond the joint model, see `numbers_of`.
    strayed : int
        Numbers of its joint model beyond the datasheet; 0 where they are no more than noise.
    rival : str
        The foreign effect that the logs do not tell from it, or empty, see `rival`.
    fit : Fit or None
        The fit, if it is at hand.

    """

    names: tuple
    excess: float
    numbers: float
    strayed: int = 0
    rival: str = ""
    fit: object = None


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """Everything that the verdict on one robot weighs.

    Parameters
    ----------
    nothing : float
        Excess of the refitted nominal model, see `evidence`.
    stray : float
        Its share that comes from numbers beyond the datasheet.
    strayed : int
        Numbers beyond the datasheet; 0 where they are no more than noise.
    free : tuple of float
        Excess with a torque that is free to depend on pose, speed and load, on logs that it was
        not fitted to: beside the refitted nominal model, beside the best hypothesis, and beside
        the best one with one cause, which has bent itself less; empty where it was not asked.
    rows : list of Row
        The best variant of each set of causes, apart by their rivals.
    base : Fit or None
        The refitted nominal model, if it is at hand.

    """

    nothing: float
    stray: float
    strayed: int
    free: tuple
    rows: list
    base: object = None


def to_json(table):
    """Table as plain types, without the fits."""
    return {"nothing": table.nothing, "stray": table.stray, "strayed": table.strayed,
            "free": list(table.free),
            "rows": [[list(row.names), row.excess, row.numbers, row.strayed, row.rival]
                     for row in table.rows]}


def from_json(kept):
    """Table from `to_json`."""
    rows = [Row(tuple(names), *numbers) for names, *numbers in kept["rows"]]
    return Table(kept["nothing"], kept["stray"], kept["strayed"], tuple(kept["free"]), rows)


def gap_beyond_noise(fit, bench):
    """Squared gap on the unseen logs over that of sensor noise, less one."""
    floor = sum(noise.floor**2 for noise in bench.noises)
    return gap(fit.hypothesis)**2 / floor - 1.0


def is_contradicted(base, bench):
    """Whether the gap of a model is far above its floor though it leaves little excess.

    The excess forgives what an unknown start would do.  Where the start is stated, with the robot
    at rest, there is nothing to forgive: a link that falls through its play does so just then.
    """
    problem = bench.problem
    return (not problem.quiet and all(log.at_rest for log in problem.logs)
            and gap_beyond_noise(base, bench) > max(excess(base), FAR))


def parameter_count(fit):
    """Numbers that a hypothesis spends beyond the joint model, at the joint that takes most.

    A number that the logs do not determine costs nothing: it excludes no course of the motion.
    What differs between the logs is spent in each of them.
    """
    at = fit.hypothesis
    moments = len(at.problem.fit) * sum(number.name == SEARCHED for member in at.members
                                        for number in member.cause.numbers)
    return moments + sum(_determined_directions(fit, member) for member in at.members)


def _determined_directions(fit, member):
    """Number of directions that are known better than their size, at the joint with most."""
    at, by_joint = fit.hypothesis, {}
    counted = {f"{member.name}.{number.name}" for number in member.cause.numbers
               if not number.nuisance}
    for i, entry in enumerate(at.open):
        if entry.key in counted:
            by_joint.setdefault(entry.joint, []).append(i)
    return max((_directions(fit, places) for places in by_joint.values()), default=0.0)


def _directions(fit, places):
    at = fit.hypothesis
    size = np.array([max(at.open[i].size, abs(at.get(at.open[i]))) for i in places])
    spread = np.linalg.eigvalsh(fit.covariance[np.ix_(places, places)] / np.outer(size, size))
    return float(np.sum(1.0 / (1.0 + np.maximum(spread, 0.0))))


def evidence(base, fits, bench=None):
    """Return the table of a refitted nominal model and of fitted hypotheses.

    A model leaves its excess; where the gap contradicts that of the nominal model, it leaves what
    is `beyond`, if that is more.

    Parameters
    ----------
    base : Fit
        The refitted nominal model.
    fits : list of Fit
        Hypotheses with causes.
    bench : Bench, optional
        Noise of the joints; without it the gap is not looked at.

    Returns
    -------
    Table
        Without a free torque; what is far behind the best is not asked for its rivals.

    """
    doubtful = bench is not None and is_contradicted(base, bench)

    def left(fit):
        return float(max(excess(fit), gap_beyond_noise(fit, bench)) if doubtful else excess(fit))

    nothing, by_names = left(base), {}
    for fit in sorted(fits, key=lambda one: one.total):
        names = tuple(sorted(member.cause.name for member in fit.hypothesis.members))
        if len(set(names)) == len(names):
            by_names.setdefault(names, []).append(fit)
    far = min(BEHIND * max(min(map(left, fits), default=0.0), SLIGHT * nothing, QUIET),
              MUCH * nothing)
    best = {(names, foreign): fit for names, same in by_names.items()
            for foreign, fit in _variants(same, lambda one: left(one) < far)}
    rows = [Row(names, left(fit), parameter_count(fit), prior_violations(fit), foreign, fit)
            for (names, foreign), fit in best.items()
            if (simpler_names(fit), foreign) not in best and not repeats_simulator(fit)]
    return Table(nothing,
                 float(base.penalty / (base.samples.sum() / base.hypothesis.problem.n)),
                 prior_violations(base), (), rows, base)


def _variants(fits, near):
    """Best of some fits of the same causes by its rival; beside it those with another or none."""
    found = {confounder(fits[0]) if near(fits[0]) else "": fits[0]}
    for fit in fits[1:] if any(found) else ():
        if near(fit):
            found.setdefault(confounder(fit), fit)
    return found.items()


def prior_violations(fit):
    """Numbers of the joint model beyond its datasheet; 0 where they are no more than noise."""
    return int(np.sum(fit.stray != 0.0)) if fit.penalty > STRAYED else 0
