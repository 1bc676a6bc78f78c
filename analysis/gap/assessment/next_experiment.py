"""The run that best tells the remaining causes apart, as set-points that a robot can follow."""

import dataclasses
import functools
import itertools

import numpy as np

from clie_blocks.analysis.gap.assessment.test_motions import (
    BANDS,
    DURATION,
    LINES,
    elementary_motions,
    motion_limits,
    multisine_motion,
    scale_inside,
)
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.method.calibration import load_calibration
from clie_blocks.analysis.gap.residual.noise import RATE, decimated, whiten
from clie_blocks.analysis.gap.verdict.posterior import NONE, UNKNOWN
from clie_blocks.errors import DivergedError

MOST_RIVALS = 4
TRIES = 6  # multisines beside the first of each band
SHARES = (0.8, 0.2)  # of a multisine's motion that comes from the set-point
APART = 1e9  # chi^2 between a model that stays finite and one that does not


@dataclasses.dataclass(frozen=True, eq=False)
class NextExperiment:
    """The recommended run.

    Parameters
    ----------
    separates : list of list of str
        Causes of the hypotheses that remain.
    menu : list of dict
        Each run with its least distance between two models [chi^2], and the expected size of the
        set after it.
    best : dict
        The recommended row of the menu.
    run : Log
        Its set-points.
    period : float
        Their sample time [s].

    """

    separates: list
    menu: list
    best: dict
    run: object
    period: float

    def as_dict(self):
        """Everything but the set-points, in plain types."""
        return {"separates": self.separates, "best": self.best, "menu": self.menu}

    def set_points(self):
        """The run as CSV text: time [s], then qd [rad] and pe [N m] of each joint."""
        joints = range(1, self.run.q_d.shape[1] + 1)
        head = ["time", *(f"qd{k}" for k in joints), *(f"pe{k}" for k in joints)]
        time = self.period * np.arange(len(self.run))
        rows = np.column_stack([time, self.run.q_d, self.run.pe])
        return "\n".join([",".join(head), *(",".join(f"{x:.7g}" for x in row) for row in rows),
                          ""])


def next_experiment(bench, base, ranking, calibration):
    """Return the experiment that separates the causes of the 90 % set, or None if one is left.

    Elementary experiments and multisines, whose lines, phases and share of set-point and torque
    are searched, are simulated with each remaining model inside the robot's limits; the whitened
    distance between two predictions is the evidence that the run would bring, and the verdict's
    own odds say how many causes it would leave.

    Parameters
    ----------
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.
    ranking : list of Standing
        Hypotheses, most probable first.
    calibration : Calibration
        Numbers of the verdict.

    """
    rivals = _rivals(ranking)
    if len(rivals) < 2:
        return None
    problem, bounds = bench.problem, motion_limits(bench.problem)
    judge = functools.partial(_score, bench, rivals, bounds,
                              _weigher(bench, base, rivals, calibration))
    judged = [row for row in map(judge, elementary_motions(problem, bounds)) if row]
    judged += _search(problem, bounds, judge)
    if not judged:
        return None
    best = min(judged, key=_worth)
    menu = sorted(judged, key=_worth)[:8]
    return NextExperiment([list(standing.names) for standing in rivals],
                          [row for row, _ in menu], best[0], best[1], problem.period)


def _worth(judged):
    """Order of experiments: few causes left, then much evidence."""
    row, _ = judged
    return row["expected_set_size"], -row["least_distance"]


def _search(problem, bounds, judge):
    """Multisines of each band, then variations of the best of them."""
    rng = np.random.default_rng(0)
    starts = [(band, rng.uniform(0, 2 * np.pi, (2, LINES, problem.n)), share)
              for band, share in itertools.product(BANDS, SHARES)]
    tried = [(judge(multisine_motion(problem, bounds, *one)), one) for one in starts]
    for _ in range(TRIES):
        tried = [pair for pair in tried if pair[0]]
        if not tried:
            break
        band, phases, share = min(tried, key=lambda pair: _worth(pair[0]))[1]
        varied = (band, phases + rng.normal(0, 1.0, phases.shape),
                  float(np.clip(share + rng.normal(0, 0.2), 0.0, 1.0)))
        tried.append((judge(multisine_motion(problem, bounds, *varied)), varied))
    return [pair[0] for pair in tried if pair[0]]


def _score(bench, rivals, bounds, weigh, log):
    """Row of the menu for one experiment, and the experiment inside the limits; or None."""
    log, leading = scale_inside(rivals[0].fit.hypothesis, log, bounds)
    if log is None:
        return None
    runs = [leading, *(_motion(standing.fit.hypothesis, log) for standing in rivals[1:])]
    distances = [_distance(bench, one, two) for one, two in itertools.combinations(runs, 2)]
    return {"experiment": log.name, "least_distance": min(distances),
            "expected_set_size": _expected_size(rivals, distances, weigh)}, log


def _rivals(ranking):
    rivals, reached = [], 0.0
    for standing in ranking:
        if reached >= 0.9 or len(rivals) == MOST_RIVALS:
            break
        reached += standing.probability
        if standing.fit is not None and standing.names not in ((NONE,), (UNKNOWN,)):
            rivals.append(standing)
    return rivals


def _motion(at, log):
    try:
        return at.simulator.run(log, at.of_log(0))[0]
    except DivergedError:
        return None


def _distance(bench, one, two):
    """Whitened squared distance between two models' motions in an experiment."""
    if one is None or two is None:
        return 0.0 if one is two else APART
    change = decimated(one - two, bench.problem.period)
    return float(sum(np.sum(whiten(change[:, k], bench.noises[k].whitener) ** 2)
                     for k in range(bench.problem.n)))


def _expected_size(rivals, distances, weigh):
    """Expected size of the 90 % set after the run, whichever of the rivals is true."""
    prior = np.array([standing.probability for standing in rivals])
    apart = np.zeros((len(rivals), len(rivals)))
    for (i, j), distance in zip(itertools.combinations(range(len(rivals)), 2), distances):
        apart[i, j] = apart[j, i] = distance
    sizes = [_size_90(weigh(prior, row)) for row in apart]
    return float(prior @ sizes / prior.sum())


def _size_90(probabilities):
    """How many causes hold nine tenths of the probability."""
    reached = np.cumsum(np.sort(probabilities / probabilities.sum())[::-1])
    return 1 + int(np.sum(reached < 0.9))


def _weigher(bench, base, rivals, calibration):
    """Function that gives the odds of the rivals after a run that drives them apart.

    The verdict weighs what a hypothesis leaves per sample, so the run is added to the old logs.
    """
    c, nothing = calibration or load_calibration(), excess(base)
    old, n = base.samples.sum(), bench.problem.n
    new = n * DURATION * RATE
    left = np.array([excess(one.fit) for one in rivals])

    def score(value):
        return -c.sharpness * np.log(np.maximum(value, 0.0) + c.floor + c.misfit * nothing)

    def weigh(prior, apart):
        after = (left * old + n * np.array(apart)) / (old + new)
        gained = score(after) - score(left)
        return prior * np.exp(gained - gained.max())

    return weigh
