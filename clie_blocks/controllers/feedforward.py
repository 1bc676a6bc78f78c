"""Feedforward of the reference: its velocity, its acceleration, and friction by its direction."""

from __future__ import annotations

from collections.abc import Sequence

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Memory, Params, VelocityFilter
from clie_blocks.controllers.wrapping import Signals, numbers, with_signals
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError

RATES = ("difference", "trajectory", "filtered")  # ways to form the velocity of the reference
BOUNDS: dict[str, tuple[str, float | None]] = {
    "feedforward_velocity": ("N m s/rad", None), "feedforward_acceleration": ("N m s^2/rad", None),
    "feedforward_coulomb": ("N m", None), "feedforward_width": ("rad/s", 1e-9)}
STATES = ("reference_1", "reference_2", "reference_3", "reference_4")
# Backward differences of fourth and third order, by which a smooth reference shows what its
# generator knew: its velocity and acceleration at the sample itself.
FIRST = np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 12.0
SECOND = np.array([35.0, -104.0, 114.0, -56.0, 11.0]) / 12.0


def with_feedforward(law: ct.NonlinearIOSystem, *, velocity: ArrayLike = 0.0,
                     acceleration: ArrayLike = 0.0, coulomb: ArrayLike = 0.0,
                     width: ArrayLike = 0.02, rate: str = "difference",
                     velocity_filter: VelocityFilter | None = None) -> ct.NonlinearIOSystem:
    """Law with feedforward: ``u = law(q_d, q, pe + kv dq_d + ka ddq_d + c tanh(dq_d/w))``.

    It enters with the excitation, so that the limit of the law and the hold of its integral act
    on the whole command.  Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` and `sampled_cascade` have them.
    velocity, acceleration, coulomb : array_like, shape (n,)
        Gains kv [N m s/rad] and ka [N m s^2/rad], and friction c [N m]; parameters of the block
        under ``feedforward_velocity`` and so on.
    width : array_like, shape (n,)
        Velocity w over which the friction changes its sign [rad/s].
    rate : str
        How dq_d is formed: ``difference`` of samples, as a ``trajectory`` generator knows it, or
        ``filtered`` as the velocity of the joint.
    velocity_filter : VelocityFilter, optional
        That of the joint, for ``filtered``.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, a number is out of range, or the rate is not known.

    """
    params = numbers(law, BOUNDS, feedforward_velocity=velocity,
                     feedforward_acceleration=acceleration, feedforward_coulomb=coulomb,
                     feedforward_width=width)
    derivatives = ReferenceRate(law, rate, velocity_filter)

    def before(memory: Sequence[np.ndarray], q_d: np.ndarray, q: np.ndarray, pe: np.ndarray,
               params: Params) -> tuple[Signals, list[np.ndarray]]:
        dq_d, ddq_d, after = derivatives(q_d, memory, params)
        added = (params["feedforward_velocity"] * dq_d + params["feedforward_acceleration"] * ddq_d
                 + params["feedforward_coulomb"] * np.tanh(dq_d / params["feedforward_width"]))
        return (q_d, q, pe + added), after

    return with_signals(law, before, STATES, params)


class ReferenceRate:
    """Velocity and acceleration of a reference in samples.

    Parameters
    ----------
    law : control.NonlinearIOSystem
        Whose period counts.
    kind : str
        One of `RATES`.
    velocity_filter : VelocityFilter, optional
        Of ``filtered``; by default the difference of samples.

    """

    def __init__(self, law: ct.NonlinearIOSystem, kind: str,
                 velocity_filter: VelocityFilter | None = None) -> None:
        if kind not in RATES:
            raise DiagramError(f"{law.name}: no velocity of the reference is called {kind!r}; "
                               f"{nearest(kind, RATES)}")
        self.period, self.kind = float(law.dt), kind
        self.filter = velocity_filter or VelocityFilter(self.period)

    def __call__(self, q_d: np.ndarray, memory: Memory, params: Params,
                 ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Velocity [rad/s], acceleration [rad/s^2], and memory one sample later."""
        step = self.period
        if self.kind == "filtered":
            rate, after = self.filter(q_d, memory[:2], params)
            return rate, (rate - memory[2]) / step, [*after, rate, memory[3]]
        rows = [q_d, *memory]
        if self.kind == "difference":
            first, second = np.array([1.0, -1.0]), np.array([1.0, -2.0, 1.0])
        else:
            first, second = FIRST, SECOND
        velocity = sum(weight * row for weight, row in zip(first.tolist(), rows)) / step
        acceleration = sum(weight * row for weight, row in zip(second.tolist(), rows)) / step**2
        return velocity, acceleration, rows[:4]
