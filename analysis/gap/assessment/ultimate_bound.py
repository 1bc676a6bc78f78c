"""What the paper's Theorem 2 predicts from the gap: the radius that the estimation error keeps to.

The gap is the estimation error of eq. (29) under a modelling error eps.  The prediction errors,
filtered by the inverse of the loop's sensitivity, give eps; its size gives mu_1, before and after
the model was corrected.
"""

import numpy as np

from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.residual.sensitivity import torque_sensitivity
from clie_blocks.linear_filters import frequency_response

BAND = 5.0  # Hz, above which an inverse filter amplifies noise only
USUAL = 0.99  # quantile of the modelling error that stands for its bound


def ultimate_bound(at):
    """Bound of the modelling error of a model, and mu_1 that follows from it.

    Parameters
    ----------
    at : Hypothesis
        A fitted model.

    Returns
    -------
    eps_bar : float
        99 % quantile of the norm of the modelling error below 5 Hz [rad/s^2].
    mu_1 : float or None
        Radius of (A.5), in the norm of ``(e, de)``; None where the condition of Theorem 1 fails.

    """
    from clie_blocks.analysis.theory.bounds import ControlledJoints, theorem_2

    law, values = at.problem.law, at.values
    errors = [modelling_error(at, j) for j in validation_logs(at.problem)]
    eps_bar = float(np.quantile(np.linalg.norm(np.concatenate(errors), axis=1), USUAL))
    if not (np.all(law.kp > 0) and np.all(law.kd > 0)):
        return eps_bar, None
    joints = ControlledJoints(values["damping"] / values["inertia"], 1.0 / values["inertia"],
                              0.0 * values["inertia"], law.kp, law.kd)
    mu_1 = theorem_2(joints, eps_bar).mu_1
    return eps_bar, mu_1 if np.isfinite(mu_1) else None


def modelling_error(at, j):
    """Acceleration that a model misses in log j, below 5 Hz, shape (N, n) [rad/s^2]."""
    error, period = at.error(j, dithered=False), at.problem.period
    grid = np.fft.rfftfreq(2 * len(error), period)
    low = (grid > 0) & (grid < BAND)
    found = np.zeros((len(grid), error.shape[1]), complex)
    mirrored = np.fft.rfft(np.concatenate([error, error[::-1]]), axis=0)
    for k, (inertia, damping) in enumerate(zip(at.values["inertia"], at.values["damping"])):
        b, a = torque_sensitivity(at.problem.law, k, inertia, damping)
        filtered = frequency_response(b, a, 2 * np.pi * grid[low] * period)
        found[low, k] = mirrored[low, k] / (filtered * inertia)
    return np.fft.irfft(found, 2 * len(error), axis=0)[:len(error)]
