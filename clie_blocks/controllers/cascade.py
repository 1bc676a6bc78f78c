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
from clie_blocks.labels import DiagramError


def sampled_cascade(kp: ArrayLike, kv: ArrayLike, ki: ArrayLike, period: float, *,
                    velocity_filter: VelocityFilter | None = None, limit: ArrayLike = UNLIMITED,
                    anti_windup: str = "conditional", every: int = 1,
                    name: str = "cascade") -> ct.NonlinearIOSystem:
    """Cascade in samples: ``u = kv w + ki T sum(w) + pe``, w = kp (q_d - q) - v, within a limit.

    The velocity v is the filtered one of the joint; the sum holds the errors w of all samples
    up to the present one.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].  At zero states the
    filter has seen zero for ever.  The position loop may run slower than the velocity loop, each
    `every` samples; its output is held in between.

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
    every : int
        Samples of the velocity loop per sample of the position loop.
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
    if every < 1 or every != int(every):
        raise DiagramError(f"{name}: every counts samples per sample of the position loop and is "
                           f"a whole number of at least 1, got {every}")

    def parts(integral: np.ndarray, memory: Memory, q_d: np.ndarray, q: np.ndarray,
              pe: np.ndarray, params: Params) -> Parts:
        rate, after = velocity(q, memory, params)
        wanted = params["kp"] * (q_d - q)
        if every > 1:
            wanted, held = at_slower_rate(wanted, memory[2], memory[3], every)
            after = [*after, *held]
        error = wanted - rate
        step = params["ki"] * period * error
        return params["kv"] * error + integral + step + pe, error, step, after

    return law_with_integral(parts, params, largest, period, anti_windup, np.zeros(n), name,
                             ("wanted", "count") if every > 1 else ())


def at_slower_rate(x: np.ndarray, held: np.ndarray, count: np.ndarray,
                   every: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Signal that is taken over each `every` samples, where `count` is 0; it and `count` later."""
    now = np.where(count < 0.5, x, held)
    return now, [now, np.where(count > every - 1.5, 0.0, count + 1.0)]
