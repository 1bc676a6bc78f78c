"""CLIE (27) on a record: Fig. 2 with the log in the place of plant and PD."""

from dataclasses import dataclass

import control as ct
import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.recorded_loop import recorded_loop
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.filters import difference_filter, velocity_filter
from clie_blocks.identification import regressor_matrix, scaled_gain
from clie_blocks.signals import signal


@dataclass(frozen=True)
class RecordedRun:
    """CLIE after its last pass over a log.

    Parameters
    ----------
    theta_hat : ndarray, shape (3n,)
        Estimates, mean over the last pass.
    history : ndarray, shape (3n, samples)
        Estimates over the last pass.
    e_u : ndarray, shape (n, samples)
        Input error of the last pass [unit of u].
    changes : tuple of float
        Largest relative change of a mean estimate from pass to pass.

    """

    theta_hat: np.ndarray
    history: np.ndarray
    e_u: np.ndarray
    changes: tuple


class RecordedLoop:
    """The recorded loop of one log, compiled, with the gain scaled to its motion.

    Parameters
    ----------
    record : clie_blocks.analysis.records.Record
        The log, with q, u, qd and the robot that made it.
    rate : float
        Wanted rate of convergence [1/s]; sets Gamma.

    Raises
    ------
    NotIdentifiableError
        If the log lacks qd or u, or its controller is not a PD law.

    """

    def __init__(self, record, rate=0.4):
        self.record = record
        controller = record.robot.controller
        self.period = controller.sample_time or float(np.median(np.diff(record.time)))
        self.kp, self.kd = pd_gains(controller)
        self.velocity = velocity_block(controller, record.n, self.period)
        self.inputs = held_inputs(record)
        phi, b = motion_regressors(record, self.period)
        gamma = scaled_gain(phi, rate, self.kp, self.kd, b)
        self.program = compile_diagram(recorded_loop(self.kp, self.kd, gamma, self.velocity))

    def run(self, theta, *, frozen=False):
        """One pass over the log from the estimates `theta`; `frozen` keeps them."""
        return self.program.run(
            (len(self.record.time) - 1) * self.period, inputs=self.inputs,
            initial_state={"model": [*self.record.q[0], *np.zeros(self.record.n)],
                           "velocity": resting_state(self.velocity, self.record.q[0]),
                           "update": theta},
            params={"update.gamma": 0.0} if frozen else None)

    def identify(self, passes, theta=None):
        """Pass over the log again and again, each time from the last estimates."""
        theta = np.zeros(3 * self.record.n) if theta is None else np.asarray(theta, float)
        means, changes = theta, []
        for _ in range(passes):
            run = self.run(theta)
            history = signal(run, "theta_hat")
            theta, before, means = history[:, -1], means, np.mean(history, axis=1)
            changes.append(float(np.max(np.abs(means - before) / np.abs(means))))
        return RecordedRun(means, history, signal(run, "e_u"), tuple(changes))

    def input_error(self, theta):
        """Input error of frozen estimates, shape (n, samples) [unit of u]."""
        return signal(self.run(theta, frozen=True), "e_u")


def pd_gains(controller):
    """Gains of a recorded controller in the form (11).

    Parameters
    ----------
    controller : clie_blocks.analysis.records.robot.Controller
        Law ``pd`` or ``cascade``.

    Returns
    -------
    kp, kd : ndarray, shape (n,)
        Proportional and derivative gain.

    Raises
    ------
    NotIdentifiableError
        If the law is not of that form.

    """
    if controller.law == "pd":
        return controller.kp, controller.kd
    if controller.law == "cascade":
        return controller.kp * controller.kv, controller.kv
    raise NotIdentifiableError(
        f"the law {controller.law!r} is not a PD law of the form (11); CLIE needs the model under "
        "the same law as the robot. State Kp and Kd in robot.toml if they are known")


def velocity_block(controller, n, period):
    """Velocity estimate of a recorded controller as a discrete-time block ``q -> dq``.

    Parameters
    ----------
    controller : clie_blocks.analysis.records.robot.Controller
        Its field `velocity_filter` decides.
    n : int
        Number of joints.
    period : float
        Sample time [s].

    Returns
    -------
    control.StateSpace
        The block, called ``velocity``.

    """
    if controller.velocity_filter == "two_corner":
        continuous = velocity_filter(n, highpass=controller.highpass, lowpass=controller.lowpass)
        rule = {"tustin": "tustin", "backward": "backward_diff", "forward": "euler",
                "zoh": "zoh"}[controller.discretisation or "tustin"]
        return ct.sample_system(continuous, period, rule, name="velocity")
    taps = 2 if controller.velocity_filter == "two_tap" else 1
    return difference_filter(n, period, taps=taps, name="velocity")


def resting_state(velocity, q):
    """State of a velocity estimate that has been at rest at position q.

    Parameters
    ----------
    velocity : control.StateSpace
        Discrete-time block ``q -> dq``.
    q : array_like, shape (n,)
        Position [rad].

    """
    balance = np.eye(velocity.nstates) - velocity.A
    return np.linalg.lstsq(balance, velocity.B @ np.asarray(q), rcond=None)[0]


def held_inputs(record):
    """Inputs of the recorded loop: one recorded row per sample.

    Parameters
    ----------
    record : clie_blocks.analysis.records.Record
        The log.

    Raises
    ------
    NotIdentifiableError
        If u or qd is missing.

    """
    missing = [name for name in ("u", "qd") if getattr(record, name) is None]
    if missing:
        raise NotIdentifiableError(f"{record.source}: the log has no {missing[0]!r}, which CLIE "
                                   "compares with the model; log it, or name its column with "
                                   f"--map {missing[0]}=COLUMN")
    pe = np.zeros_like(record.u) if record.pe is None else record.pe
    return {"u": record.u, "q_d": record.qd, "pe": pe}


def motion_regressors(record, period):
    """Regressors (13) along a recorded motion, and rough values of B to scale the gain with.

    Parameters
    ----------
    record : clie_blocks.analysis.records.Record
        The log.
    period : float
        Sample time [s].

    Returns
    -------
    phi : ndarray, shape (samples, 3n, n)
        Regressors with the differenced position.
    b : ndarray, shape (n,)
        One over the inertia from the momentum balance ``integral u = J dq + R q + d t + c``,
        which needs no acceleration.

    """
    dq = np.gradient(record.q, period, axis=0)
    momentum = np.cumsum(record.u, axis=0) * period
    time = np.arange(len(dq)) * period
    inertia = [np.linalg.lstsq(np.column_stack((dq[:, k], record.q[:, k], time,
                                                np.ones_like(time))), momentum[:, k],
                               rcond=None)[0][0] for k in range(record.n)]
    phi = np.stack([regressor_matrix(*row) for row in zip(dq[::20], record.u[::20])])
    return phi, 1.0 / np.abs(inertia)
