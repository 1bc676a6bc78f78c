"""Rates of convergence of a study over the gains of the update law."""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.theory.averaging import averaged_rates
from clie_blocks.analysis.theory.convergence import Rates, composite_rates, floquet_rates

GAMMAS = np.geomspace(2.5, 640, 33)
ALPHAS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)


@dataclass(frozen=True)
class Convergence:
    """Predicted rates of the update law over Gamma, and over alpha at the chosen Gamma.

    Parameters
    ----------
    gammas : ndarray, shape (m,)
        Gains.
    rates : list of Rates
        One per gain.
    averaged : ndarray, shape (m, n)
        Rates by averaging [1/s].
    here : Rates
        At the gain of the study.
    over_alpha : dict
        Alpha to `Rates`, at the gain of the study.

    """

    gammas: np.ndarray
    rates: list[Rates]
    averaged: np.ndarray
    here: Rates
    over_alpha: dict[float, Rates]

    @property
    def best(self) -> tuple[float, Rates]:
        """Gain with the fastest slow mode, and its rates."""
        k = int(np.argmax([rates.slowest for rates in self.rates]))
        return float(self.gammas[k]), self.rates[k]

    def gain_for(self, time: float, remaining: float = 0.01) -> float | None:
        """Smallest gain of the sweep that reaches a fraction in a time [s]; None if none."""
        enough = [gamma for gamma, rates in zip(self.gammas, self.rates)
                  if rates.time_to(remaining) <= time]
        return float(enough[0]) if enough else None


def analyse_convergence(study: Study) -> Convergence:
    """Floquet rates of the update law around the true parameters over `GAMMAS`, and averages."""
    *rates, here = floquet_rates(study.loop, [*GAMMAS, study.gamma])
    over_alpha = dict(zip(ALPHAS, composite_rates(study.loop, study.gamma, ALPHAS)))
    return Convergence(GAMMAS, rates, averaged_rates(study.loop, GAMMAS), here, over_alpha)
