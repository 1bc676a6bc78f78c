"""Random numbers and random switches, alike for all copies that run the same experiment."""

from collections.abc import Sequence

import numpy as np


class LaneRandom:
    """Random numbers for all lanes: the same on all copies that run the same experiment.

    Parameters
    ----------
    seed : sequence of int
        Of all of them.
    experiments : sequence
        Experiment of each lane.
    n : int
        Number of joints.

    """

    def __init__(self, seed: Sequence[int], experiments: Sequence[object], n: int) -> None:
        order = list(dict.fromkeys(map(id, experiments)))
        self.lane = [order.index(id(experiment)) for experiment in experiments]
        self.n = n
        self.sources = [np.random.default_rng([*seed, k]) for k in range(len(order))]

    def __call__(self, kind: str) -> np.ndarray:
        """Draw of a kind, a method of the generator, shape (lanes, n)."""
        return np.stack([getattr(source, kind)(self.n) for source in self.sources])[self.lane]


class RandomSwitch:
    """Switch that is off and on for times of exponential length (telegraph noise).

    Parameters
    ----------
    random : LaneRandom
        Source of chance.
    off, on : float
        Mean times [s].
    step : float
        Time from one call to the next [s].

    """

    def __init__(self, random: LaneRandom, off: float, on: float, step: float) -> None:
        self.random, self.leave_off, self.leave_on = random, step / off, step / on
        self.closed: np.ndarray | None = None

    def __call__(self) -> np.ndarray:
        """Whether it is on, shape (lanes, n)."""
        draw = self.random("random")
        if self.closed is None:
            self.closed = np.zeros(draw.shape, bool)
        self.closed = np.where(self.closed, draw >= self.leave_on, draw < self.leave_off)
        return self.closed
