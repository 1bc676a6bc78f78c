"""Fig. 2 with a log in the place of plant and PD, compiled: one pass of CLIE over the log."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.identification.motion import rough_inertia
from clie_blocks.analysis.identification.signals_of_log import (
    command,
    excitation,
    reference,
    robot_of,
)
from clie_blocks.analysis.records.control_law import gains
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.recorded_composite import recorded_composite
from clie_blocks.diagrams.recorded_loop import recorded_loop
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.filters import difference_filter, velocity_filter
from clie_blocks.identification import regressor_matrix, scaled_gain
from clie_blocks.signals import signal

if TYPE_CHECKING:
    from clie_blocks.compiled.program import Program

SPARSE = 20  # samples of the log between two regressors that scale the gain
RULES = {"tustin": "tustin", "backward": "backward_diff", "forward": "euler", "zoh": "zoh"}


@dataclasses.dataclass(frozen=True, eq=False)
class LogLoop:
    """The identification loop of one log, with the adaptation gain scaled to its motion.

    Parameters
    ----------
    record : Record
        The log, with q, u, qd and the robot that made it.
    kp, kd : ndarray, shape (n,)
        PD gains of the recorded controller.
    velocity : control.StateSpace
        Its velocity estimate, discrete-time.
    program : Program
        The compiled diagram.

    """

    record: Record
    kp: np.ndarray
    kd: np.ndarray
    velocity: ct.StateSpace
    program: Program

    @classmethod
    def of(cls, record: Record, rate: float, share: float | None = None) -> LogLoop:
        """Loop with the update law (27), or the composite (40) where it has a `share`.

        Parameters
        ----------
        record : Record
            The log.
        rate : float
            Wanted rate of convergence [1/s].
        share : float, optional
            Part of the convergence of (40) that its gradient part does.

        Raises
        ------
        NotIdentifiableError
            If u or qd is missing in the log, or its controller is not a PD law.

        """
        reference(record)  # an error early, where there is none
        controller = robot_of(record).controller
        kp, kd = pd_gains(controller)
        velocity = velocity_block(controller, record.n,
                                  controller.sample_time or record.sample_time)
        b = 1.0 / rough_inertia(record)
        gamma = scaled_gain(_regressors(record, velocity.dt), rate, kp, kd, b)
        diagram = (recorded_loop(kp, kd, gamma, velocity) if share is None else recorded_composite(
            kp, kd, gamma, share * float(np.mean(kd / (kp * b))), velocity))
        return cls(record, kp, kd, velocity, compile_diagram(diagram))

    def run(self, theta: np.ndarray, *, frozen: bool = False) -> ct.TimeResponseData:
        """One pass over the log from the estimates `theta`; `frozen` keeps them."""
        record, program = self.record, self.program
        blocks = {block for block, _ in program.states}
        start: dict[str, ArrayLike] = {
            "model": [*record.q[0], *np.zeros(record.n)], "update": theta,
            "velocity": resting_state(self.velocity, record.q[0])}
        inputs = {"u": command(record), "q_d": reference(record), "pe": excitation(record)}
        if "q[0]" in program.inputs:
            inputs["q"] = record.q
        return program.run((len(record) - 1) * self.velocity.dt, inputs=inputs, log=None,
                           initial_state={name: x for name, x in start.items() if name in blocks},
                           params={"update.gamma": 0.0} if frozen else None)

    def scores(self, theta: np.ndarray) -> np.ndarray:
        """Terms ``Phi Kd Kp^-1 e_u`` of the update law with held estimates, shape (N, 3n)."""
        run = self.run(theta, frozen=True)
        dq, u, e_u = (signal(run, name) for name in ("dq_model", "u_model", "e_u"))
        weighted = (self.kd / self.kp)[:, None] * e_u
        return np.vstack((dq * weighted, -u * weighted, weighted)).T


def pd_gains(controller: Controller) -> tuple[np.ndarray, np.ndarray]:
    """Gains Kp, Kd, each of shape (n,), of a recorded controller in the form (11).

    Raises
    ------
    NotIdentifiableError
        If the law is not of that form.

    """
    if controller.law in ("pd", "cascade"):
        return gains(controller)
    raise NotIdentifiableError(
        f"the law {controller.law!r} is not a PD law of the form (11); CLIE needs the model under "
        "the same law as the robot. State Kp and Kd in robot.toml if they are known")


def velocity_block(controller: Controller, n: int, period: float) -> ct.StateSpace:
    """Velocity estimate of a recorded controller as a discrete-time block ``q -> dq``.

    Its field `velocity_filter` decides; the block is called ``velocity``.
    """
    if controller.velocity_filter == "two_corner":
        corners = {name: getattr(controller, name) for name in ("highpass", "lowpass")}
        continuous = velocity_filter(n, **corners)
        rule = RULES[controller.discretisation or "tustin"]
        return ct.sample_system(continuous, period, rule, name="velocity")
    taps = 2 if controller.velocity_filter == "two_tap" else 1
    return difference_filter(n, period, taps=taps, name="velocity")


def resting_state(velocity: ct.StateSpace, q: np.ndarray) -> np.ndarray:
    """State of a velocity estimate that has been at rest at position q."""
    balance = np.eye(velocity.nstates) - velocity.A
    return np.linalg.lstsq(balance, velocity.B @ np.asarray(q), rcond=None)[0]


def _regressors(record: Record, period: float) -> np.ndarray:
    """Regressors (13) along the recorded motion, shape (samples, 3n, n)."""
    dq, u = np.gradient(record.q, period, axis=0)[::SPARSE], command(record)[::SPARSE]
    return np.stack([regressor_matrix(*row) for row in zip(dq, u)])
