"""Inverse-dynamics least squares: where to start when no datasheet states the joint model."""

import numpy as np

CORNER = 20.0  # Hz of the zero-phase low-pass before differentiation


def inverse_dynamics_model(logs, period):
    """Inertia, damping and offset of each joint from smoothed motion and commands.

    Parameters
    ----------
    logs : sequence of Log
        Motion and commands.
    period : float
        Sample time [s].

    Returns
    -------
    inertia, damping, load : ndarray, shape (n,)
        Coefficients of eq. (8); dry friction is fitted beside them and left out.

    """
    from scipy.signal import butter, sosfiltfilt

    low = butter(4, min(CORNER, 0.2 / period), fs=1.0 / period, output="sos")
    found = []
    for k in range(logs[0].q.shape[1]):
        rows, right = [], []
        for log in logs:
            q, u = (sosfiltfilt(low, x[:, k]) for x in (log.q, log.u))
            dq = np.gradient(q, period)
            ddq = np.gradient(dq, period)
            rows.append(np.stack([ddq, dq, np.ones_like(q), np.sign(dq)], axis=1))
            right.append(u)
        found.append(np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0])
    inertia, damping, load, _ = np.array(found).T
    return np.maximum(np.abs(inertia), 1e-9), np.maximum(damping, 0.0), load
