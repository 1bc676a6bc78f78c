"""What a family of trials is, and the one way in which any of its trials is made."""

from dataclasses import dataclass

import numpy as np

ATTEMPTS = 20
LOST = 2.0  # rad off the set-point: nobody would log a robot that does that


class RejectedError(Exception):
    """A draw that no laboratory would have logged; the words say why."""


@dataclass(frozen=True, eq=False)
class Trial:
    """What is written to the trial's folder, and its label.

    Parameters
    ----------
    robot : Robot
        As stated.
    motions : list of Motion
        The experiments.
    runs : list of (q, u)
        The logs.
    label : dict
        The truth.

    """

    robot: object
    motions: list
    runs: list
    label: dict


@dataclass(frozen=True)
class Family:
    """Trials of one kind.

    Parameters
    ----------
    draw : callable
        ``draw(rng, seed, index)`` makes a `Trial`; seed and index say what comes in turn, `rng`
        is the source of all chance.  It raises `RejectedError` where a draw is no good.
    stream : tuple of int
        Keeps the draws apart from those of other families of the same seed.

    """

    draw: object
    stream: tuple = ()


def make_trial(family, seed, index):
    """Make one trial; its label keeps why draws before it were rejected.

    Parameters
    ----------
    family : Family
        Which kind.
    seed : int
        Of the study.
    index : int
        Number of the trial; fixes what comes in turn, all else is drawn.

    Returns
    -------
    Trial
        The same for the same family and numbers.

    """
    rejected = []
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, index, attempt, *family.stream])
        try:
            trial = family.draw(rng, seed, index)
        except RejectedError as reason:
            rejected.append(str(reason))
        else:
            trial.label["rejected"] = rejected
            return trial
    raise RuntimeError(f"trial {index} of seed {seed}: {rejected}")


def lost(motions, runs):
    """Whether a robot leaves its set-point as nobody would log it."""
    return any(np.abs(q - motion.q_d).max() > LOST for motion, (q, _) in zip(motions, runs))
