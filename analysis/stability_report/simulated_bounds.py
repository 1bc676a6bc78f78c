"""Simulated loops: what they do, against what the bounds allow."""

from collections.abc import Callable
from typing import Any, TypeVar

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.errors import DivergedError
from clie_blocks.signals import signal

STEP = 1e-3  # s; ode5 is exact to 8 digits here
EVERY, IDENTIFICATION_EVERY = 5, 20

Result = TypeVar("Result")
Trajectory = tuple[np.ndarray, np.ndarray, np.ndarray]  # time, position error, velocity


def unless_diverged(simulate: Callable[..., Result], *arguments: Any, **options: Any,
                    ) -> Result | None:
    """Result of a simulation, or None where it diverged."""
    try:
        return simulate(*arguments, **options)
    except DivergedError:
        return None


def pd_trajectory(plant: ct.NonlinearIOSystem, joints: ControlledJoints, q_d: np.ndarray,
                  pe: Callable[[float], ArrayLike], duration: float = 40.0) -> Trajectory:
    """Run the PD loop, Fig. 1, from rest at zero.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    joints : ControlledJoints
        Gains.
    q_d : array_like, shape (n,)
        Set-point [rad].
    pe : callable
        Excitation [N m].
    duration : float
        Simulated time [s].

    Returns
    -------
    time : ndarray, shape (samples,)
        Time [s].
    q_err, dq : ndarray, shape (n, samples)
        Position error [rad] and velocity [rad/s].

    """
    program = compile_diagram(joint_loop(plant, joints.kp, joints.kd))
    run = program.run(duration, step=STEP, inputs={"q_d": q_d, "pe": pe}, every=EVERY)
    return run.time, np.asarray(q_d)[:, None] - signal(run, "q"), signal(run, "dq")


def ultimate_radius(time: np.ndarray, *rows: np.ndarray, after: float = 20.0) -> float:
    """Largest norm of stacked signals after a time.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Time [s].
    *rows : ndarray, shape (n, samples)
        The signals.
    after : float
        The transient that is left out [s].

    """
    return float(np.max(np.linalg.norm(np.vstack(rows)[:, time >= after], axis=0)))


def identification_errors(plant: ct.NonlinearIOSystem, joints: ControlledJoints, q_d: np.ndarray,
                          pe: Callable[[float], ArrayLike], *, gamma: ArrayLike, alpha: float,
                          duration: float = 400.0,
                          ) -> tuple[dict[str, np.ndarray] | None, dict[str, np.ndarray] | None]:
    """Run the identification loop with (27) and with (40), and return the errors of both.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    joints : ControlledJoints
        The joints (9) that stand for the true robot, and gains.
    q_d : array_like, shape (n,)
        Set-point [rad].
    pe : callable
        Excitation [N m].
    gamma : float or array_like, shape (3n,)
        Adaptation gain of (40), or its diagonal.
    alpha : float
        Gain of the gradient method in (40).
    duration : float
        Simulated time [s].

    Returns
    -------
    gradient, composite : dict
        ``time`` and, as rows, ``e``, ``de``, ``e_f``; with (27) also the modelling errors ``eps``
        of (29) and ``eps_f`` of (45).  None where the loop diverged.

    """
    program = compile_diagram(clie_composite(plant, joints.kp, joints.kd, gamma, alpha))
    errors = ["q", "dq", "q_model", "dq_model", "e_f"]

    def run(alpha: float, *more: str) -> ct.TimeResponseData | None:
        return unless_diverged(
            program.run, duration, step=STEP, inputs={"q_d": q_d, "pe": pe, "noise": 0.0},
            every=IDENTIFICATION_EVERY, log=[*errors, *more], params={"update.alpha": alpha})

    gradient, composite = run(0.0, "u", "theta_hat", "filtered_regressor.phi_f"), run(alpha)
    return (gradient and _errors(gradient) | _modelling_errors(gradient, plant, joints),
            composite and _errors(composite))


def _errors(run: ct.TimeResponseData) -> dict[str, np.ndarray]:
    """Errors of the model along a run."""
    return {"time": run.time, "e": signal(run, "q") - signal(run, "q_model"),
            "de": signal(run, "dq") - signal(run, "dq_model"), "e_f": signal(run, "e_f")}


def _modelling_errors(run: ct.TimeResponseData, plant: ct.NonlinearIOSystem,
                      joints: ControlledJoints) -> dict[str, np.ndarray]:
    """What no parameters explain along a run, (29) and filtered (45)."""
    theta_err = signal(run, "theta_hat") - joints.theta[:, None]
    phi_f = signal(run, "filtered_regressor.phi_f").reshape(3 * joints.n, joints.n, -1)
    motion = (signal(run, name) for name in ("q", "dq", "u"))
    return {"eps": modelling_error(plant, joints, *motion),
            "eps_f": signal(run, "e_f") + np.einsum("pns,ps->ns", phi_f, theta_err)}


def modelling_error(plant: ct.NonlinearIOSystem, joints: ControlledJoints, q: np.ndarray,
                    dq: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Residual of eq. (9), ``ddq + A dq - B u + D``: the error in (29), with its true sign.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        The plant with states q, dq.
    joints : ControlledJoints
        The joints (9) that stand for it.
    q, dq, u : ndarray, shape (n, samples)
        Its motion and input.

    """
    n = joints.n
    ddq = np.array([plant.dynamics(0.0, np.concatenate((x, v)), torque)[n:]
                    for x, v, torque in zip(q.T, dq.T, u.T)]).T
    a, b, d = (value[:, None] for value in (joints.a, joints.b, joints.d))
    return ddq + a * dq - b * u + d
