"""PID in samples, with a filtered velocity, a limit, and an integral that is held at it."""

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
from clie_blocks.labels import DiagramError


def sampled_pid(kp: ArrayLike, ki: ArrayLike, kd: ArrayLike, period: float, *,
                velocity_filter: VelocityFilter | None = None, velocity_of_error: bool = False,
                limit: ArrayLike = UNLIMITED, anti_windup: str = "conditional",
                tracking_time: ArrayLike = 0.1, name: str = "pid") -> ct.NonlinearIOSystem:
    """PID in samples: ``u = kp e + ki T sum(e) - kd v + pe``, e = q_d - q, within a limit.

    The velocity v is the filtered one of the joint, or of q - q_d.  The sum holds the errors of
    all samples up to the present one.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].  At
    zero states the filter has seen zero for ever.

    Parameters
    ----------
    kp, ki, kd : array_like, shape (n,)
        Gains [N m/rad, N m/(rad s), N m s/rad]; parameters of the block under these keys.
    period : float
        Sample time [s].
    velocity_filter : VelocityFilter, optional
        By default the difference of samples; corners are parameters of the block.
    velocity_of_error : bool
        Damp the error of the velocity instead of the velocity.
    limit : array_like, shape (n,)
        Largest command [N m].
    anti_windup : str
        ``conditional``, ``back_calculation`` or ``none``, see `integral_step`.
    tracking_time : array_like, shape (n,)
        Of back-calculation [s].
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
    params = checked(name, n, period, anti_windup, kp=(kp, "N m/rad", 0.0),
                     ki=(ki, "N m/(rad s)", 0.0), kd=(kd, "N m s/rad", 0.0),
                     limit=(limit, "N m", 0.0), tracking_time=(tracking_time, "s", 0.0))
    if not np.all(params["tracking_time"] > 0):
        raise DiagramError(f"{name}: tracking_time must be positive")
    back = period / params.pop("tracking_time")
    largest = params.pop("limit")
    params |= velocity.parameters(name, n)

    def parts(integral: np.ndarray, memory: Memory, q_d: np.ndarray, q: np.ndarray,
              pe: np.ndarray, params: Params) -> Parts:
        error = q_d - q
        rate, after = velocity(-error if velocity_of_error else q, memory, params)
        step = params["ki"] * period * error
        free = params["kp"] * error + integral + step - params["kd"] * rate + pe
        return free, error, step, after

    return law_with_integral(parts, params, largest, period, anti_windup, back, name)
