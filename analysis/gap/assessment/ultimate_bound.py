"""What the paper's Theorem 2 predicts from the gap: the radius that the estimation error keeps to.

The gap is the estimation error of eq. (29) under a modelling error eps.  The prediction errors,
filtered by the inverse of the loop's sensitivity, give eps; its size gives mu_1, before and after
the model was corrected.
"""

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.linear_filters import frequency_response


def ultimate_bound(hypothesis: Hypothesis, method: AssessmentMethod,
                   ) -> tuple[float, float | None]:
    """Bound of the modelling error of a fitted model, and mu_1 that follows from it.

    Returns
    -------
    eps_bar : float
        99 % quantile of the norm of the modelling error at low frequency [rad/s^2].
    mu_1 : float or None
        Radius of (A.5), in the norm of ``(e, de)``; None where the condition of Theorem 1 is
        violated, and under a law that is not (11).

    """
    from clie_blocks.analysis.theory.bounds import ControlledJoints, theorem_2

    law, values = hypothesis.problem.law, hypothesis.values
    errors = np.concatenate([modelling_error(hypothesis, j, method.bound_band)
                             for j in validation_logs(hypothesis.problem)])
    eps_bar = float(np.quantile(np.linalg.norm(errors, axis=1), method.bound_quantile))
    if isinstance(law, BlockLaw) or not (np.all(law.kp > 0) and np.all(law.kd > 0)):
        return eps_bar, None
    joints = ControlledJoints(values["damping"] / values["inertia"], 1.0 / values["inertia"],
                              0.0 * values["inertia"], law.kp, law.kd)
    mu_1 = theorem_2(joints, eps_bar).mu_1
    return eps_bar, mu_1 if np.isfinite(mu_1) else None


def modelling_error(hypothesis: Hypothesis, j: int, band: float) -> np.ndarray:
    """Acceleration that a model misses in log j below a frequency [Hz], shape (N, n) [rad/s^2]."""
    error, period = hypothesis.error(j, dithered=False), hypothesis.problem.period
    frequency = np.fft.rfftfreq(2 * len(error), period)
    is_low = (frequency > 0) & (frequency < band)
    missed = np.zeros((len(frequency), error.shape[1]), complex)
    mirrored = np.fft.rfft(np.concatenate([error, error[::-1]]), axis=0)
    values = hypothesis.values
    for k, (inertia, damping) in enumerate(zip(values["inertia"], values["damping"])):
        b, a = hypothesis.problem.law.torque_sensitivity(k, inertia, damping)
        sensitivity = frequency_response(b, a, 2 * np.pi * frequency[is_low] * period)
        missed[is_low, k] = mirrored[is_low, k] / (sensitivity * inertia)
    return np.fft.irfft(missed, 2 * len(error), axis=0)[:len(error)]
