"""What a population of trials is, and the one way in which any of its trials is made."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.robot import DrawnRobot

ATTEMPTS = 20
FARTHEST_ERROR = 2.0  # rad off the set-point: nobody would log a robot that does that
Run = tuple[np.ndarray, np.ndarray]  # measured position [rad] and command [N m], shape (N, n)


class RejectedError(Exception):
    """A draw that no laboratory would have logged; the text says why."""


@dataclass(frozen=True, eq=False)
class Trial:
    """The robot as stated, its experiments and logs, and the label that is sealed.

    `truth` are the parameters with which the engine ran, for what a population adds to its label.
    """

    robot: DrawnRobot
    experiments: list[Experiment]
    runs: list[Run]
    label: dict[str, Any]
    others: Sequence[np.ndarray] = ()  # positions of the other encoders [rad], where there are two
    truth: dict[str, np.ndarray] | None = None


@dataclass(frozen=True)
class Population:
    """Trials of one kind.

    Parameters
    ----------
    draw : callable
        ``draw(rng, seed, index)`` makes a `Trial`; seed and index fix what comes in turn, `rng`
        is the source of all chance.  It raises `RejectedError` if the draw is unusable.
    stream : tuple of int
        Keeps the draws apart from those of other populations of the same seed.

    """

    draw: Callable[[np.random.Generator, int, int], Trial]
    stream: tuple[int, ...] = ()


def make_trial(population: Population, seed: int, index: int) -> Trial:
    """Make one trial, the same for the same arguments.

    Parameters
    ----------
    population : Population
        Which kind.
    seed : int
        Of the study.
    index : int
        Number of the trial; fixes what comes in turn, all else is drawn.

    Returns
    -------
    Trial
        Its label keeps why earlier draws were rejected.

    """
    rejected: list[str] = []
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, index, attempt, *population.stream])
        try:
            trial = population.draw(rng, seed, index)
        except RejectedError as reason:
            rejected.append(str(reason))
        else:
            trial.label["rejected"] = rejected
            return trial
    raise RuntimeError(f"trial {index} of seed {seed}: {rejected}")


def leaves_set_point(experiments: Sequence[Experiment], runs: Sequence[Run]) -> bool:
    """Whether a robot leaves its set-point so far that nobody would log it."""
    return any(np.abs(q - experiment.q_d).max() > FARTHEST_ERROR
               for experiment, (q, _) in zip(experiments, runs))
