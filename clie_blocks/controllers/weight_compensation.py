"""Compensation of the weight of the links, added to any sampled law."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params
from clie_blocks.controllers.wrapping import Signals, joints_of, with_signals
from clie_blocks.labels import vector

KEY = "compensation"


def with_weight_compensation(law: ct.NonlinearIOSystem, weight: Callable[[np.ndarray], np.ndarray],
                             share: ArrayLike = 1.0) -> ct.NonlinearIOSystem:
    """Law that also carries the links: ``u = law(q_d, q, pe + share G(q))``, G of eq. (1).

    The weight enters with the excitation, so that the limit of the law and the hold of its
    integral act on the whole command.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` and `sampled_cascade` have them.
    weight : callable
        Torque (n,) that holds the links at positions (n,) [rad], on the side of the command [N m].
    share : array_like, shape (n,)
        Of it that the law adds; a parameter of the block, ``compensation``.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the states, the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, or a share is no number.

    """
    n = joints_of(law)
    shares = vector(np.broadcast_to(share, n), f"{law.name}: {KEY}", n=n, unit="1")

    def carried(memory: Sequence[np.ndarray], q_d: np.ndarray, q: np.ndarray, pe: np.ndarray,
                params: Params) -> tuple[Signals, list[np.ndarray]]:
        return (q_d, q, pe + params[KEY] * weight(q)), []

    return with_signals(law, carried, (), {KEY: shares})
