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
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.identification.columns import terms
from clie_blocks.analysis.identification.motion import Run
from clie_blocks.analysis.identification.regression import Estimate, solve, top_speed
from clie_blocks.analysis.identification.signals_of_log import (
    command,
    excitation,
    reference,
    robot_of,
)
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.replay import velocity
from clie_blocks.analysis.theory.sampled_loop import held_plant, loop_polynomials
from clie_blocks.errors import DivergedError
from clie_blocks.linear_filters import lfilter

PASSES = 40
CONVERGED = 1e-7
UNBOUNDED = 1e6  # times the motion: an error of a loop that is unstable


@dataclasses.dataclass(frozen=True, eq=False)
class Loop:
    """Loop of one joint, in powers of ``z^-1``.

    Parameters
    ----------
    torque, sensor, denominator : ndarray
        Sensitivities of `loop_polynomials`: position per torque, and measured position per
        sensor error.

    """

    torque: np.ndarray
    sensor: np.ndarray
    denominator: np.ndarray

    def respond(self, torque: np.ndarray) -> np.ndarray:
        """Position of the loop at rest under a held torque."""
        return lfilter(self.torque, self.denominator, torque)

    def noise_gain(self, samples: int = 20_000) -> float:
        """Ratio of the measured position's noise to that of the sensor, both rms, white sensor."""
        impulse = np.zeros(samples)
        impulse[0] = 1.0
        return float(np.linalg.norm(lfilter(self.sensor, self.denominator, impulse)))


def sensitivity(inertia: float, viscous: float, controller: Controller, k: int,
                step: float) -> Loop:
    """Loop of joint k with inertia J and viscous friction F, in units of the command."""
    law = control_law(controller, step)
    return Loop(*loop_polynomials(held_plant(inertia, viscous, step), law.kp[k], law.kd[k],
                                  (law.numerator[:, k], law.denominator[:, k])))


def closed_loop_least_squares(runs: Sequence[Run], loads: Sequence[np.ndarray], k: int,
                              start: Estimate) -> Estimate:
    """Least squares of the closed-loop position error on the terms of the model's own motion.

    `loads` holds the known load torque of each run, shape (N, n); `start` is where to begin, such
    as `idim_least_squares`.  The intervals are block-robust.

    Raises
    ------
    DivergedError
        If it does not settle.

    """
    value = start.value.copy()
    value[0] = abs(value[0])
    speed = top_speed(runs, k)
    for _ in range(PASSES):
        with np.errstate(over="ignore", invalid="ignore"):  # of an unstable loop, see below
            parts = [_linearise(run, load, k, start.names, value, speed)
                     for run, load in zip(runs, loads, strict=True)]
        _check_finite(parts, runs, k)
        fit = solve(np.vstack([part[0] for part in parts]),
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


def _check_finite(parts: Sequence[tuple[np.ndarray, np.ndarray]], runs: Sequence[Run], k: int,
                  ) -> None:
    """Refuse a loop that grows without bound at the rate of the log."""
    largest = UNBOUNDED * max(float(np.ptp(run.q[:, k])) for run in runs)
    if not all(np.isfinite(columns).all() and np.abs(error).max(initial=0.0) < largest
               for columns, error in parts):
        raise DivergedError(
            f"{runs[0].record.joints[k]}: the loop of the stated law and a rigid joint grows "
            f"without bound at the rate of the log, {1.0 / runs[0].step:.4g} Hz; a controller "
            "that runs faster cannot be replayed from it: log every cycle of the controller, or "
            "check its gains")


def model_motion(run: Run, load: np.ndarray, k: int, names: Sequence[str], value: np.ndarray,
                 speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, Loop]:
    """Position, velocity and acceleration of the model under the recorded law, and its loop.

    Terms beyond the paper's three act as recorded: they are evaluated on the measured motion.
    """
    loop = sensitivity(value[0], value[1], robot_of(run.record).controller, k, run.step)
    drive = _drive(run, k)
    beyond = terms(names[2:], run.q[:, k], run.dq[:, k], run.ddq[:, k], speed) @ value[2:]
    start = run.record.q[0, k]
    q = start + loop.respond(drive - load[:, k] - beyond)
    dq = np.gradient(q, run.step)
    return q, dq, np.gradient(dq, run.step), loop


def _drive(run: Run, k: int) -> np.ndarray:
    """Torque of the law on the model apart from its own position: reference, pe, and residual.

    The residual of the replayed law enters as recorded; it carries saturation and rounding.
    """
    record, controller = run.record, robot_of(run.record).controller
    law = control_law(controller, run.step)
    linear = dataclasses.replace(law, saturation=np.full(run.record.n, np.inf))
    qd, pe, u = reference(record), excitation(record), command(record)
    dq = velocity(record, controller, law.variant)
    replayed = linear.command(qd - record.q, dq, pe)[:, k]
    return law.kp[k] * (qd[:, k] - record.q[0, k]) + pe[:, k] + u[:, k] - replayed


def _linearise(run: Run, load: np.ndarray, k: int, names: Sequence[str], value: np.ndarray,
               speed: float) -> tuple[np.ndarray, np.ndarray]:
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
