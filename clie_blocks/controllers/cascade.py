"""Position P around velocity PI in samples: the cascade of industrial drives."""

from __future__ import annotations

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import (
    UNLIMITED,
    Memory,
    Params,
    Parts,
    VelocityFilter,
    checked,
    law_with_integral,
)


def sampled_cascade(kp: ArrayLike, kv: ArrayLike, ki: ArrayLike, period: float, *,
                    velocity_filter: VelocityFilter | None = None, limit: ArrayLike = UNLIMITED,
                    anti_windup: str = "conditional",
                    name: str = "cascade") -> ct.NonlinearIOSystem:
    """Cascade in samples: ``u = kv w + ki T sum(w) + pe``, w = kp (q_d - q) - v, within a limit.

    The velocity v is the filtered one of the joint; the sum holds the errors w of all samples
    up to the present one.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].  At zero states the
    filter has seen zero for ever.  Where it is wrong: both loops run at one rate, and drives often
    run the inner one faster.

    Parameters
    ----------
    kp, kv, ki : array_like, shape (n,)
        Gains [1/s, N m s/rad, N m/rad]; parameters of the block under these keys.
    period : float
        Sample time [s].
    velocity_filter : VelocityFilter, optional
        By default the difference of samples; corners are parameters of the block.
    limit : array_like, shape (n,)
        Largest command [N m].
    anti_windup : str
        ``conditional`` or ``none``, see `integral_step`.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        The block, in discrete time.

    Raises
    ------
    DiagramError
        If a gain is negative, lengths differ, or the anti-windup is not known.

    """
    n = np.size(kp)
    velocity = velocity_filter or VelocityFilter(period)
    params = checked(name, n, period, anti_windup, kp=(kp, "1/s", 0.0),
                     kv=(kv, "N m s/rad", 0.0), ki=(ki, "N m/rad", 0.0),
                     limit=(limit, "N m", 0.0))
    largest = params.pop("limit")
    params |= velocity.parameters(name, n)

    def parts(integral: np.ndarray, memory: Memory, q_d: np.ndarray, q: np.ndarray,
              pe: np.ndarray, params: Params) -> Parts:
        rate, after = velocity(q, memory, params)
        error = params["kp"] * (q_d - q) - rate
        step = params["ki"] * period * error
        return params["kv"] * error + integral + step + pe, error, step, after

    return law_with_integral(parts, params, largest, period, anti_windup, np.zeros(n), name)
