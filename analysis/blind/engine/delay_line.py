"""Samples of some time ago: what a slow bus, a buffer or a second clock makes of a signal."""

import numpy as np


class DelayLine:
    """The last samples of a signal; before the first one it held that.

    Parameters
    ----------
    longest : float
        Longest delay that is asked for [s].
    period : float
        Time between samples [s].

    """

    def __init__(self, longest: float, period: float) -> None:
        self.count, self.period, self.newest = int(longest / period) + 3, period, -1
        self.samples: np.ndarray | None = None

    def append(self, sample: np.ndarray) -> None:
        """Add a sample, shape (lanes, n)."""
        if self.samples is None:
            self.samples = np.repeat(sample[None], self.count, axis=0)
        self.newest += 1
        self.samples[self.newest % self.count] = sample

    def held(self, delay: np.ndarray, since: float = 0.0) -> np.ndarray:
        """Signal some time ago if every sample is held until the next one.

        Parameters
        ----------
        delay : ndarray, shape (lanes, n)
            How long ago [s].
        since : float
            Time since the newest sample [s].

        """
        return self._back(np.ceil((delay - since) / self.period - 1e-9).clip(0).astype(int))

    def between(self, delay: np.ndarray) -> np.ndarray:
        """Signal some time before the newest sample, on the straight line between samples."""
        back, share = np.divmod(delay / self.period, 1.0)
        back = back.astype(int)
        return (1 - share) * self._back(back) + share * self._back(back + 1)

    def _back(self, steps: np.ndarray) -> np.ndarray:
        if self.samples is None:
            raise ValueError("a delay line is read after its first sample")
        at = (self.newest - np.minimum(steps, self.count - 1)) % self.count
        return np.take_along_axis(self.samples, at[None], axis=0)[0]
