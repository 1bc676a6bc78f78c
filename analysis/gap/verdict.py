"""From fitted hypotheses to probabilities, sets and one verdict.

Each hypothesis is judged by the excess of its chi^2 over the noise, relative to the samples of one
joint.  A true cause leaves next to nothing; what it does leave is misfit, not noise, so the odds
follow the logarithm of the excess rather than chi^2 itself.  `none` wins where the refitted
nominal model leaves little, `unknown` where nothing in the library removes most of the excess.
"""

import dataclasses
import json
from pathlib import Path

import numpy as np

STRAYED = 9.0  # squared sigmas beyond the datasheet that speak of a parametric mismatch
NONE, UNKNOWN, PARAMETRIC = "none", "unknown", "parametric"


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Numbers that turn excess into odds; learned by `calibrate`.

    Parameters
    ----------
    sharpness : float
        Nats per factor e of excess.
    floor : float
        Excess per sample that a right model may leave.
    price : float
        Nats per number of a hypothesis.
    second : float
        Nats that each further cause costs.
    share, slight : float
        A further cause that removes less than this share of the whole excess costs `slight` nats
        per factor e that it falls short; strong effects bend the motion in ways that no kernel
        matches to the last digit, and a second cause must not live on that.
    healthy : float
        Excess per sample that a healthy robot may have.
    unexplained_share : float
        Share of the excess that something unknown would leave.
    unexplained_least : float
        Least excess per sample that counts as unexplained.
    parametric : float
        Nats that a joint model outside its datasheet costs, against an effect that explains it.
    lapse : float
        Probability spread evenly, for what nobody thought of.

    """

    sharpness: float = 6.0
    floor: float = 0.05
    price: float = 2.0
    second: float = 1.5
    share: float = 0.01
    slight: float = 4.0
    healthy: float = 0.5
    unexplained_share: float = 0.25
    unexplained_least: float = 2.0
    parametric: float = 2.0
    lapse: float = 0.01


def learned():
    """Return the calibration that is stored with the package."""
    path = Path(__file__).with_name("calibration.json")
    if not path.is_file():
        return Calibration()
    return Calibration(**json.loads(path.read_text())["numbers"])


@dataclasses.dataclass(frozen=True, eq=False)
class Standing:
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


def excess(fit, extra=0):
    """chi^2 beyond the noise per sample of one joint, with the price of the numbers."""
    samples = fit.samples.sum()
    numbers = sum(entry.tolerance is None for entry in fit.hypothesis.open) + extra
    beyond = fit.total + numbers * np.log(samples) - samples
    return beyond / (samples / fit.hypothesis.problem.n)


def numbers_of(fit):
    """Numbers that a hypothesis spends beyond the joint model."""
    return sum(not number.fixed for member in fit.hypothesis.members
               for number in member.cause.numbers)


def standings(base, fits, calibration):
    """Rank the refitted nominal model, the fitted hypotheses, and `unknown`.

    Parameters
    ----------
    base : Fit
        The refitted nominal model.
    fits : list of Fit
        Hypotheses with causes.
    calibration : Calibration
        The numbers.

    Returns
    -------
    list of Standing
        Most probable first; probabilities sum to one.

    """
    c = calibration

    def score(value):
        return -c.sharpness * np.log(max(value, 0.0) + c.floor)

    nothing = excess(base)
    stray = base.penalty / (base.samples.sum() / base.hypothesis.problem.n)
    healthy = max(nothing - stray - c.healthy, 0.0)
    left = max(c.unexplained_share * nothing, c.unexplained_least)
    rows = [((NONE,), base, nothing, score(healthy + stray)),
            ((UNKNOWN,), None, left, score(left))]
    if base.penalty > STRAYED:
        rows.append(((PARAMETRIC,), base, nothing - stray,
                     score(healthy) - c.price * np.sum(base.stray != 0.0) - c.parametric))
    best = _best_of_each(fits)
    for names, fit in best.items():
        rows.append((names, fit, excess(fit), score(excess(fit)) - c.price * numbers_of(fit)
                     - _further(names, fit, best, nothing, c)))
    scores = np.array([row[3] for row in rows])
    weights = np.exp(scores - scores.max())
    weights = (1.0 - c.lapse) * weights / weights.sum() + c.lapse / len(rows)
    found = [Standing(*row[:3], float(weight)) for row, weight in zip(rows, weights)]
    return sorted(found, key=lambda standing: -standing.probability)


def _further(names, fit, best, nothing, c):
    """What the causes beyond the first cost [nats]."""
    if len(names) == 1:
        return 0.0
    fewer = [excess(other) for known, other in best.items() if set(known) < set(names)]
    gained = (min(fewer, default=nothing) - excess(fit)) / nothing
    short = np.log(c.share / min(max(gained, 1e-6), c.share))
    return c.second * (len(names) - 1) + c.slight * short


def _best_of_each(fits):
    """Best variant of each set of causes, by names."""
    best = {}
    for fit in fits:
        names = tuple(sorted(member.cause.name for member in fit.hypothesis.members))
        if len(set(names)) == len(names) and (names not in best or fit.total < best[names].total):
            best[names] = fit
    return best


def marginals(ranking):
    """Probability of each cause, over all hypotheses that hold it."""
    found = {}
    for standing in ranking:
        for name in standing.names:
            found[name] = found.get(name, 0.0) + standing.probability
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def set_90(ranking):
    """Smallest set of names that holds nine tenths of the probability."""
    names, reached = [], 0.0
    for standing in ranking:
        if reached >= 0.9:
            break
        names += [name for name in standing.names if name not in names]
        reached += standing.probability
    return names


def verdict(ranking, established=False):
    """One word: effect, parametric, none or unexplained.

    Parameters
    ----------
    ranking : list of Standing
        From `standings`.
    established : bool
        The controller check alone found a cause.

    """
    if established:
        return "effect"
    words = {NONE: "none", UNKNOWN: "unexplained", PARAMETRIC: "parametric"}
    return words.get(ranking[0].names[0], "effect")
