"""Residual of a law in the commands of a log, from where its velocity filter is known.

A filter that begins at rest with the log is known from the first sample on.  In a log that was cut
out of a longer run it is known once it has forgotten how that run began; behind samples that were
lost, once it has forgotten what stands in their place.
"""

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records.control_law import ControlLaw


def first_known_sample(log: Log, law: ControlLaw, slower: int = 1) -> int:
    """First sample at which the velocity is known of the law, or of one so many times slower."""
    return 0 if log.at_rest else min(slower * law.settling, len(log) // 2)


def known_samples(log: Log, law: ControlLaw, slower: int = 1) -> np.ndarray:
    """Mask of the samples from `first_known_sample` on, and so long behind losses, shape (N,)."""
    sample, settling = np.arange(len(log)), slower * law.settling
    known = sample >= first_known_sample(log, law, slower)
    if log.measured is None:
        return known
    last_lost = np.maximum.accumulate(np.where(log.measured, -settling - 1, sample))
    settled = known & (sample - last_lost > settling)
    return settled if settled.any() else known & log.measured


def law_residual(law: StatedLaw, log: Log, delay: int = 0) -> np.ndarray:
    """Logged command less that of the law `delay` samples before it, shape (samples, n)."""
    residual = log.u[delay:] - law.commands(log)[:len(log) - delay]
    if log.measured is None:
        return residual[first_known_sample(log, law):]
    return residual[known_samples(log, law)[delay:]]
