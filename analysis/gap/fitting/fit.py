"""A fitted hypothesis: how well it does, and how sure its parameters are."""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.residual.whitening import DIVERGED

FAR = 100.0  # times the largest motion of the logs: a model that is as far off has diverged


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis and how well it does.

    Parameters
    ----------
    hypothesis : Hypothesis
        With its fitted values.
    chi2 : ndarray, shape (logs, n)
        Whitened squared error of each log (those held out included) and joint.
    samples : ndarray, shape (logs, n)
        Whitened samples.
    prior_violation : ndarray, shape (free parameters,)
        Distances beyond the datasheet [standard deviations].
    covariance : ndarray, shape (free parameters, free parameters)
        From the Jacobian: what the logs and the bounds of the datasheet determine.
    spread : ndarray, shape (free parameters,)
        Standard deviations that are reported to the user, see `standard_deviations`.
    iterations : int
        Steps that were kept.

    """

    hypothesis: Hypothesis
    chi2: np.ndarray
    samples: np.ndarray
    prior_violation: np.ndarray
    covariance: np.ndarray
    spread: np.ndarray
    iterations: int

    @property
    def penalty(self) -> float:
        """Squared distances from the datasheet."""
        return float(self.prior_violation @ self.prior_violation)

    @property
    def cost(self) -> float:
        """chi^2 on the fit logs with the datasheet's penalty."""
        return float(self.chi2[:len(self.hypothesis.problem.fit)].sum() + self.penalty)

    @property
    def total(self) -> float:
        """chi^2 on all logs with the datasheet's penalty."""
        return float(self.chi2.sum() + self.penalty)

    @property
    def excess(self) -> float:
        """chi^2 beyond the noise per sample of one joint, with the price of the parameters."""
        samples = self.samples.sum()
        free = sum(parameter.tolerance is None for parameter in self.hypothesis.free_parameters)
        beyond = self.total + free * np.log(samples) - samples
        return beyond / (samples / self.hypothesis.problem.n)

    @functools.cached_property
    def has_diverged(self) -> bool:
        """Whether the model diverges in one of the logs, or leaves the motion far behind."""
        logs = self.hypothesis.problem.logs
        limit = min(DIVERGED, FAR * max(float(np.ptp(log.q, axis=0).max()) for log in logs))
        return any(np.abs(self.hypothesis.error(j)).max() >= limit for j in range(len(logs)))
