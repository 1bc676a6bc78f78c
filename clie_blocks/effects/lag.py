"""First-order lag with a neutral value: what several effects share."""

import numpy as np

from clie_blocks.labels import PerJoint


def lag_rate(z: np.ndarray, signal: np.ndarray, lag: PerJoint) -> np.ndarray:
    """Rate of the lagged signal: ``(signal - z) / lag``; without a lag it rests."""
    return np.where(lag > 0, (signal - z) / np.where(lag > 0, lag, 1.0), 0.0)


def lag_step(z: np.ndarray, signal: np.ndarray, lag: PerJoint, period: float) -> np.ndarray:
    """Lagged signal one period later, the signal held meanwhile: exact."""
    share = 1.0 - np.exp(-period / np.where(lag > 0, lag, 1.0))
    return np.where(lag > 0, z + share * (signal - z), 0.0)


def mean_lagged(z: np.ndarray, signal: np.ndarray, lag: PerJoint, period: float) -> np.ndarray:
    """Mean over a period of the lagged signal that starts at z; without a lag the signal."""
    time = np.where(lag > 0, lag, 1.0)
    share = (1.0 - np.exp(-period / time)) * time / period
    return np.where(lag > 0, signal + (z - signal) * share, signal)


def lagged(z: np.ndarray, signal: np.ndarray, lag: PerJoint) -> np.ndarray:
    """Lagged signal; without a lag the signal itself, bit for bit."""
    return np.where(lag > 0, z, signal)
