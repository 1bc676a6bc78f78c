"""Laws around a law: what is done to its signals before it, and to its command behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params
from clie_blocks.labels import DiagramError, signals, vector

PORTS = ("q_d", "q", "pe")
Signals = tuple[np.ndarray, np.ndarray, np.ndarray]
Before = Callable[[Sequence[np.ndarray], np.ndarray, np.ndarray, np.ndarray, Params],
                  tuple[Signals, list[np.ndarray]]]
Behind = Callable[[Sequence[np.ndarray], np.ndarray, np.ndarray, Params],
                  tuple[np.ndarray, list[np.ndarray]]]


def with_signals(law: ct.NonlinearIOSystem, before: Before, states: Sequence[str] = (),
                 params: Mapping[str, np.ndarray] | None = None) -> ct.NonlinearIOSystem:
    """Law on other signals: ``before(memory, q_d, q, pe, params)`` gives these and its memory.

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With the inputs q_d, q, pe and the output u.
    before : callable
        Signals for the law, and memory one sample later; each of shape (n,).
    states : sequence of str
        Names of the memory, n values each.
    params : mapping
        Further parameters of the block.

    Raises
    ------
    DiagramError
        If the law has other ports.

    """
    n = joints_of(law)

    def both(x: np.ndarray, u: np.ndarray, params: Params) -> tuple[np.ndarray, np.ndarray]:
        own = x[law.nstates:]
        memory = [own[k * n:(k + 1) * n] for k in range(len(states))]
        given, after = before(memory, u[:n], u[n:2 * n], u[2 * n:], params)
        return np.concatenate(given), np.concatenate([own[:0], *after])

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        given, after = both(x, u, params)
        if not law.nstates:
            return after
        return np.concatenate((law.updfcn(t, x[:law.nstates], given, params), after))

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return law.outfcn(t, x[:law.nstates], both(x, u, params)[0], params)

    return _block(law, update, output, states, params)


def with_command(law: ct.NonlinearIOSystem, behind: Behind, states: Sequence[str] = (),
                 params: Mapping[str, np.ndarray] | None = None) -> ct.NonlinearIOSystem:
    """Law whose command is changed: ``behind(memory, u, q, params)`` gives it and its memory.

    Parameters and errors are those of `with_signals`.
    """
    n = joints_of(law)

    def both(t: float, x: np.ndarray, u: np.ndarray,
             params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        own = x[law.nstates:]
        memory = [own[k * n:(k + 1) * n] for k in range(len(states))]
        return behind(memory, law.outfcn(t, x[:law.nstates], u, params), u[n:2 * n], params)

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        after = np.concatenate([x[law.nstates:][:0], *both(t, x, u, params)[1]])
        if not law.nstates:
            return after
        return np.concatenate((law.updfcn(t, x[:law.nstates], u, params), after))

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return both(t, x, u, params)[0]

    return _block(law, update, output, states, params)


def joints_of(law: ct.NonlinearIOSystem) -> int:
    """Number of joints of a law that can be built upon."""
    n = int(law.noutputs)
    if law.input_labels != signals(*PORTS, n=n):
        raise DiagramError(f"{law.name}: a law that is built upon has the inputs "
                           f"{', '.join(signals(*PORTS, n=n))}, in this order; it has "
                           f"{', '.join(law.input_labels)}")
    return n


def numbers(law: ct.NonlinearIOSystem, bounds: Mapping[str, tuple[str, float | None]],
            **values: ArrayLike) -> dict[str, np.ndarray]:
    """Numbers by key, one per joint of a law, checked against unit and least value in `bounds`."""
    n = joints_of(law)
    return {key: vector(np.broadcast_to(value, n), f"{law.name}: {key}", n=n,
                        unit=bounds[key][0], least=bounds[key][1])
            for key, value in values.items()}


def _block(law: ct.NonlinearIOSystem, update: Callable[..., np.ndarray],
           output: Callable[..., np.ndarray], states: Sequence[str],
           params: Mapping[str, np.ndarray] | None) -> ct.NonlinearIOSystem:
    names = [*law.state_labels, *signals(*states, n=int(law.noutputs))]
    return ct.nlsys(update if names else None, output, dt=law.dt, name=law.name,
                    params={**law.params, **(params or {})}, states=names,
                    inputs=law.input_labels, outputs=law.output_labels)
