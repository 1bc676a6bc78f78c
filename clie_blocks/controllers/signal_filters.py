"""Low-pass and notch on the error of a law, or on its command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params, filtered
from clie_blocks.controllers.wrapping import Signals, numbers, with_command, with_signals
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError

PLACES = ("error", "command")
OPEN = 1e9  # rad/s: the corner of a low-pass that lets everything pass
BOUNDS: dict[str, tuple[str, float | None]] = {
    f"{place}_{key}": (unit, 1e-9) for place in PLACES
    for key, unit in (("lowpass", "rad/s"), ("notch", "rad/s"), ("notch_width", "1"))}
Filter = Callable[[np.ndarray, Sequence[np.ndarray], Params], tuple[np.ndarray, list[np.ndarray]]]


def with_filter(law: ct.NonlinearIOSystem, place: str, *, lowpass: ArrayLike | None = None,
                notch: ArrayLike | None = None, notch_width: ArrayLike = 0.5,
                ) -> ct.NonlinearIOSystem:
    """Law with filters on its error or its command.

    A low-pass ``y += (1 - exp(-w T)) (x - y)``, and a notch ``(s^2 + w^2)/(s^2 + 2 z w s + w^2)``
    by Tustin's rule with its frequency kept, one behind the other.  Filtered is the error
    q_d - q alone, not the velocity of the joint.  Inputs: q_d, q [rad], pe [N m].  Outputs:
    u [N m].

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` has them.
    place : str
        ``error`` or ``command``.
    lowpass, notch : array_like, shape (n,), optional
        Corner and frequency [rad/s]; parameters of the block, such as ``command_lowpass``.
    notch_width : array_like, shape (n,)
        Damping z of the notch's poles.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, the place is not known, or a number is not positive.

    """
    if place not in PLACES:
        raise DiagramError(f"{law.name}: no signal {place!r} is filtered; "
                           f"{nearest(place, PLACES)}")
    step, chain = float(law.dt), list[tuple[int, Filter]]()
    given: dict[str, ArrayLike] = {}
    if lowpass is not None:
        given[f"{place}_lowpass"] = lowpass
        chain.append((1, _low_pass(f"{place}_lowpass", step)))
    if notch is not None:
        given |= {f"{place}_notch": notch, f"{place}_notch_width": notch_width}
        chain.append((2, _notch(f"{place}_notch", step)))
    params = numbers(law, BOUNDS, **given)
    names = [f"{place}_filter_{k + 1}" for k in range(sum(states for states, _ in chain))]

    def through(x: np.ndarray, memory: Sequence[np.ndarray],
                params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        after: list[np.ndarray] = []
        for states, one in chain:
            first = len(after)
            x, own = one(x, memory[first:first + states], params)
            after += own
        return x, after

    def before(memory: Sequence[np.ndarray], q_d: np.ndarray, q: np.ndarray, pe: np.ndarray,
               params: Params) -> tuple[Signals, list[np.ndarray]]:
        error, after = through(q_d - q, memory, params)
        return (q + error, q, pe), after

    def behind(memory: Sequence[np.ndarray], u: np.ndarray, q: np.ndarray,
               params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        return through(u, memory, params)

    if place == "error":
        return with_signals(law, before, names, params)
    return with_command(law, behind, names, params)


def _low_pass(key: str, step: float) -> Filter:
    def one(x: np.ndarray, memory: Sequence[np.ndarray],
            params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        y = memory[0] + (1.0 - np.exp(-step * params[key])) * (x - memory[0])
        return y, [y]
    return one


def _notch(key: str, step: float) -> Filter:
    def one(x: np.ndarray, memory: Sequence[np.ndarray],
            params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        return filtered(x, memory, *notch_coefficients(params[key], params[f"{key}_width"], step))
    return one


def notch_coefficients(frequency: Any, width: Any, step: float) -> tuple[list[Any], list[Any]]:
    """Coefficients b, a of a sampled notch, in powers of 1/z."""
    w = np.tan(0.5 * step * frequency)
    scale = 1.0 / (1.0 + 2.0 * width * w + w * w)
    even, middle = (1.0 + w * w) * scale, 2.0 * (w * w - 1.0) * scale
    return [even, middle, even], [1.0, middle, (1.0 - 2.0 * width * w + w * w) * scale]
