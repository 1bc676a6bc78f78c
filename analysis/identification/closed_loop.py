"""Closed-loop least squares through the sensitivity filter.

With the control law known, the error between the measured position and a model under the same law
is the equation error through the loop's sensitivity ``S``, exactly:

    e = q - q_model = -S [dJ ddq + dF dq + dc + ...],    S = 1 / (J s^2 + F s + C(s))

with C the PD law and its velocity filter.  Regressing e on the S-filtered terms of the model's own
motion, and moving the model to the result until nothing changes, is output error in closed loop at
the cost of a few regressions, with regressors free of noise.  All filters are discrete-time, at
the controller's sample time and with its hold.
"""

import dataclasses

import numpy as np
from scipy.signal import lfilter

from clie_blocks.analysis.identification.columns import terms
from clie_blocks.analysis.identification.regression import Estimate, solved, top_speed
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.replay import velocity
from clie_blocks.errors import DivergedError

PASSES = 40
CONVERGED = 1e-7
SMALL = 1e-4  # damping over rate from which the plain formula of the held plant loses digits


@dataclasses.dataclass(frozen=True, eq=False)
class Loop:
    """Loop of one joint, in powers of ``z^-1``.

    Parameters
    ----------
    top, bottom : ndarray
        Sensitivity, position per torque.
    open_bottom : ndarray
        Denominator of plant and velocity filter; over `bottom` it is what noise of the sensor
        becomes in the measured position.

    """

    top: np.ndarray
    bottom: np.ndarray
    open_bottom: np.ndarray

    def respond(self, torque):
        """Position of the loop at rest under a held torque."""
        return lfilter(self.top, self.bottom, torque, axis=0)

    def noise_gain(self, samples=20_000):
        """Ratio of the measured position's noise to that of the sensor, both rms, white sensor."""
        impulse = np.zeros(samples)
        impulse[0] = 1.0
        return float(np.linalg.norm(lfilter(self.open_bottom, self.bottom, impulse)))


def sensitivity(inertia, viscous, controller, k, step):
    """Sensitivity of a joint's loop, torque to position.

    Parameters
    ----------
    inertia, viscous : float
        J and F in units of the command.
    controller : Controller
        Gains and velocity filter.
    k : int
        Joint.
    step : float
        Sample time [s].

    Returns
    -------
    Loop
        ``P / (1 + P C)`` with the plant P held over each sample.

    """
    plant, bottom = held_plant(inertia, viscous, step)
    law = control_law(controller, step)
    below = law.denominator[:, k]
    law_top = law.kp[k] * below + law.kd[k] * law.numerator[:, k]
    outside = np.convolve(bottom, below)
    closed = np.polynomial.polynomial.polyadd(outside, np.convolve(plant, law_top))
    return Loop(np.convolve(plant, below), closed, outside)


def held_plant(inertia, viscous, step):
    """Plant ``1 / (J s^2 + F s)`` behind a zero-order hold, in powers of ``z^-1``."""
    rate = viscous / inertia * step
    forget = np.exp(-rate)
    if abs(rate) < SMALL:  # series of the two formulas below
        first, second = 0.5 - rate / 6, 0.5 - rate / 3
    else:
        first = (rate - 1 + forget) / rate**2
        second = (1 - forget - rate * forget) / rate**2
    gain = step**2 / inertia
    return gain * np.array([0.0, first, second]), np.array([1.0, -1.0 - forget, forget])


def closed_loop_least_squares(runs, loads, k, start):
    """Least squares of the closed-loop position error on the terms of the model's own motion.

    Parameters
    ----------
    runs : list of Run
        Experiments.
    loads : list of ndarray, shape (N, n)
        Known load torque of each run.
    k : int
        Joint.
    start : Estimate
        Where to begin, such as that of `idim_least_squares`.

    Returns
    -------
    Estimate
        With block-robust intervals.

    Raises
    ------
    DivergedError
        If it does not settle.

    """
    value = start.value.copy()
    value[0] = abs(value[0])
    speed = top_speed(runs, k)
    for _ in range(PASSES):
        parts = [_linearised(run, load, k, start.names, value, speed)
                 for run, load in zip(runs, loads, strict=True)]
        fit = solved(np.vstack([part[0] for part in parts]),
                     np.concatenate([part[1] for part in parts]), runs[0].record.joints[k],
                     start.names)
        change = fit.value
        stride = min(1.0, 0.5 * value[0] / max(abs(change[0]), 1e-300))
        value = value + stride * change
        if np.all(np.abs(change) <= CONVERGED * np.abs(value) + 1e-3 * fit.interval):
            return Estimate("closed-loop LS", start.names, value, fit.interval)
    raise DivergedError(f"{runs[0].record.joints[k]}: the closed-loop least squares does not "
                        f"settle in {PASSES} passes; is the stated control law the one that ran? "
                        "'clie check' replays it")


def model_motion(run, load, k, names, value, speed):
    """Position, velocity and acceleration of the model under the recorded law, and its loop.

    Terms beyond the paper's three act as recorded: they are evaluated on the measured motion.
    """
    loop = sensitivity(value[0], value[1], run.record.robot.controller, k, run.step)
    drive = _drive(run, k)
    beyond = terms(names[2:], run.q[:, k], run.dq[:, k], run.ddq[:, k], speed) @ value[2:]
    start = run.record.q[0, k]
    q = start + loop.respond(drive - load[:, k] - beyond)
    dq = np.gradient(q, run.step)
    return q, dq, np.gradient(dq, run.step), loop


def _drive(run, k):
    """Torque of the law on the model apart from its own position: reference, pe, and residual.

    The residual of the replayed law enters as recorded; it carries saturation and rounding.
    """
    record, controller = run.record, run.record.robot.controller
    law = control_law(controller, run.step)
    linear = dataclasses.replace(law, saturation=np.inf)
    pe = np.zeros_like(record.u) if record.pe is None else record.pe
    dq = velocity(record, controller, law.variant)
    asked = linear.command(record.qd - record.q, dq, pe)[:, k]
    return law.kp[k] * (record.qd[:, k] - record.q[0, k]) + pe[:, k] + record.u[:, k] - asked


def _linearised(run, load, k, names, value, speed):
    """Filtered terms and position error of a run, freed of its unknown initial state."""
    q, dq, ddq, loop = model_motion(run, load, k, names, value, speed)
    moved = terms(names, q, dq, ddq, speed)
    moved[:, 3:] = terms(names[3:], run.q[:, k], run.dq[:, k], run.ddq[:, k], speed)
    kick = np.zeros((len(q), 2))
    kick[0, 0] = kick[1, 1] = 1.0
    free = np.linalg.qr(loop.respond(kick))[0]
    columns, error = -loop.respond(moved), run.record.q[:, k] - q
    columns = columns - free @ (free.T @ columns)
    error = error - free @ (free.T @ error)
    return columns[run.inner], error[run.inner]
