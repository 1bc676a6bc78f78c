"""Motions of a robot at work, as references from rest with their derivatives."""

import numpy as np

STILL, MOVING = (1.0, 3.0), (0.4, 1.0)  # s, of a pause and a move
FARTHEST = 1.0  # rad


class PickAndPlace:
    """Moves of least jerk between places, with long standstills.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    n : int
        Joints.
    seconds : float
        Length [s].

    """

    def __init__(self, rng: np.random.Generator, n: int, seconds: float) -> None:
        starts, places, lengths = [], [np.zeros(n)], []
        time = rng.uniform(*STILL) / 2.0
        while time < seconds:
            starts.append(time)
            lengths.append(rng.uniform(*MOVING))
            places.append(rng.uniform(-FARTHEST, FARTHEST, n))
            time += lengths[-1] + rng.uniform(*STILL)
        self.starts, self.lengths, self.places = np.array(starts), lengths, places

    def __call__(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration at a time [s], each of shape (n,)."""
        k = int(np.searchsorted(self.starts, t, side="right")) - 1
        if k < 0:
            still = np.zeros_like(self.places[0])
            return self.places[0], still, still
        length, way = self.lengths[k], self.places[k + 1] - self.places[k]
        s = min((t - self.starts[k]) / length, 1.0)
        return (self.places[k] + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2),
                way / length * 30.0 * s**2 * (1.0 - s)**2,
                way / length**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s))
