"""Several laws side by side: each joint runs under one of them."""

from __future__ import annotations

from collections.abc import Sequence

import control as ct
import numpy as np

from clie_blocks.controllers.sampled import Params
from clie_blocks.controllers.wrapping import joints_of
from clie_blocks.labels import DiagramError


def laws_side_by_side(laws: Sequence[ct.NonlinearIOSystem],
                      choice: Sequence[int]) -> ct.NonlinearIOSystem:
    """Law that takes the command of joint k from ``laws[choice[k]]``.

    A parameter that several laws have is one parameter of the block; its value at a joint is that
    of the joint's law.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].

    Parameters
    ----------
    laws : sequence of control.NonlinearIOSystem
        With these ports, all joints and one rate.
    choice : sequence of int, length n
        Law of each joint.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If the laws have other ports, or differ in joints or rate.

    """
    first, n = laws[0], joints_of(laws[0])
    if any(joints_of(law) != n or law.dt != first.dt for law in laws) or len(choice) != n:
        raise DiagramError(f"{first.name}: laws side by side have the same joints and rate, and "
                           "one of them is chosen for each joint")
    edges = np.cumsum([0, *(law.nstates for law in laws)]).tolist()
    masks = [np.array([float(one == j) for one in choice]) for j in range(len(laws))]
    params: dict[str, np.ndarray] = {}
    for j, law in enumerate(laws):
        for key, value in law.params.items():
            params[key] = np.where(masks[j] > 0, value, params.get(key, value))

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return np.concatenate([law.updfcn(t, x[edges[j]:edges[j + 1]], u, params)
                               for j, law in enumerate(laws) if law.nstates])

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        commands = [law.outfcn(t, x[edges[j]:edges[j + 1]], u, params)
                    for j, law in enumerate(laws)]
        return np.array([commands[j][k] for k, j in enumerate(choice)])

    return ct.nlsys(update if edges[-1] else None, output, dt=first.dt, name=first.name,
                    params=params, inputs=first.input_labels, outputs=first.output_labels,
                    states=[f"{j}_{label}" for j, law in enumerate(laws)
                            for label in law.state_labels])
