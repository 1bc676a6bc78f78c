"""Compensation of the weight of the links, added to any sampled law."""

from __future__ import annotations

from collections.abc import Callable

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params
from clie_blocks.labels import DiagramError, signals, vector

KEY = "compensation"
PORTS = ("q_d", "q", "pe")


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
    n = law.noutputs
    if law.input_labels != signals(*PORTS, n=n):
        raise DiagramError(f"{law.name}: a law that carries the links has the inputs "
                           f"{', '.join(signals(*PORTS, n=n))}, in this order; it has "
                           f"{', '.join(law.input_labels)}")
    shares = vector(np.broadcast_to(share, n), f"{law.name}: {KEY}", n=n, unit="1")

    def carried(u: np.ndarray, params: Params) -> np.ndarray:
        q_d, q, pe = u[:n], u[n:2 * n], u[2 * n:]
        return np.concatenate((q_d, q, pe + params[KEY] * weight(q)))

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return law.updfcn(t, x, carried(u, params), params)

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return law.outfcn(t, x, carried(u, params), params)

    return ct.nlsys(update, output, dt=law.dt, name=law.name, params={**law.params, KEY: shares},
                    states=law.state_labels, inputs=law.input_labels, outputs=law.output_labels)
