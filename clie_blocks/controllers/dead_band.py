"""Dead band and punch of a servo: small errors do nothing, others at least something."""

from __future__ import annotations

from collections.abc import Sequence

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params
from clie_blocks.controllers.wrapping import Signals, numbers, with_signals

BOUNDS: dict[str, tuple[str, float | None]] = {"dead_band": ("rad", 0.0), "punch": ("N m", 0.0)}


def with_dead_band(law: ct.NonlinearIOSystem, dead_band: ArrayLike = 0.0,
                   punch: ArrayLike = 0.0) -> ct.NonlinearIOSystem:
    """Law on the part of the error beyond a dead band, with a least command beyond it.

    With e = q_d - q, ``u = law(q + b, q, pe + punch sign(b))``, b = e less the dead band towards
    zero.  Inputs: q_d, q [rad], pe.  Outputs: u; in a servo a duty cycle, else N m.

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` has them.
    dead_band : array_like, shape (n,)
        Half its width [rad]; a parameter of the block.
    punch : array_like, shape (n,)
        Least command beyond it, as that of the law; a parameter of the block.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the states, the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, or a number is negative.

    """
    params = numbers(law, BOUNDS, dead_band=dead_band, punch=punch)

    def before(memory: Sequence[np.ndarray], q_d: np.ndarray, q: np.ndarray, pe: np.ndarray,
               params: Params) -> tuple[Signals, list[np.ndarray]]:
        beyond = error_beyond(q_d - q, params["dead_band"])
        return (q + beyond, q, pe + params["punch"] * np.sign(beyond)), []

    return with_signals(law, before, (), params)


def error_beyond(error: np.ndarray, dead_band: np.ndarray) -> np.ndarray:
    """Part of an error beyond a dead band [rad]."""
    return np.sign(error) * np.maximum(np.abs(error) - dead_band, 0.0)
