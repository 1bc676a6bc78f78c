"""The update law by averaging: the estimates are taken as frozen over a period.

Linear in Gamma, and right only while Gamma is small; the exact rates are in
`clie_blocks.analysis.theory.convergence`.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.theory.convergence import STEP, FloquetLoop, PeriodicLoop
from clie_blocks.analysis.theory.opening import transfer
from clie_blocks.identification import scaled_gain
from clie_blocks.signals import signal

PAPER_RATE = 1 / 400  # 1/s, averaged rate of the paper's loop at Gamma = I


def averaged_matrix(loop: PeriodicLoop) -> np.ndarray:
    """Averaged dynamics of the parametric error, per unit of Gamma, shape (3n, 3n).

    ``mean(Phi Kd Kp^-1 (G Phi^T))`` over a period, where G, the response of e_u to a slow change
    of the estimates, is linearised from the diagram cut at ``model.theta_hat``.

    Parameters
    ----------
    loop : PeriodicLoop
        The loop; its term in alpha is left out, being far slower.

    Returns
    -------
    ndarray
        Parametric errors obey ``d theta_err/dt = -Gamma M theta_err`` on average.

    """
    robot = loop.joints
    phi = steady_regressor(loop)
    omega = 2 * np.pi * np.fft.rfftfreq(phi.shape[1], STEP)
    filtered = np.fft.rfft(phi, axis=1) * _input_error_response(loop, omega)
    answer = np.fft.irfft(filtered, phi.shape[1], axis=1)
    weight = robot.kd / robot.kp
    blocks = np.einsum("isk,jsk,k->kij", phi, answer, weight) / phi.shape[1]
    n = robot.n
    matrix = np.zeros((3 * n, 3 * n))
    for k in range(n):
        matrix[k::n, k::n] = blocks[k]
    return loop.diagonal(1.0)[:, None] * matrix


def averaged_rates(loop: PeriodicLoop, gammas: ArrayLike) -> np.ndarray:
    """Slowest rate of each joint by averaging, shape (m, n) [1/s].

    Parameters
    ----------
    loop : PeriodicLoop
        The loop.
    gammas : array_like, shape (m,)
        Adaptation gains.

    """
    matrix, n = averaged_matrix(loop), loop.joints.n
    slowest = [np.min(np.linalg.eigvals(matrix[k::n, k::n]).real) for k in range(n)]
    return np.outer(np.atleast_1d(gammas), slowest)


def steady_regressor(loop: PeriodicLoop) -> np.ndarray:
    """Regressor (13) of each joint on the periodic orbit of the true loop, shape (3, samples, n).

    Parameters
    ----------
    loop : PeriodicLoop
        The loop; its samples are 1 ms apart and cover one period.

    """
    compiled = FloquetLoop(loop)
    x, _ = compiled.orbit(1.0)
    run = compiled.period_run(x, 1.0, ["dq", "u"])
    dq, u = signal(run, "dq")[:, :-1].T, signal(run, "u")[:, :-1].T
    return np.array([dq, -u, np.ones_like(u)])


def balanced_shape(loop: PeriodicLoop) -> np.ndarray:
    """Diagonal of Gamma that lets all estimates converge alike, shape (3n,).

    Times a gain g the averaged rate of each joint is g/400 per second, which is what Gamma = g I
    gives on the paper's robot.

    Parameters
    ----------
    loop : PeriodicLoop
        The loop.

    """
    robot, n = loop.joints, loop.joints.n
    rows = steady_regressor(loop)  # (3, samples, n)
    phi = np.zeros((rows.shape[1], 3 * n, n))
    for k in range(n):
        phi[:, k::n, k] = rows[:, :, k].T
    shape = scaled_gain(phi, PAPER_RATE, robot.kp, robot.kd, robot.b)
    slowest = averaged_rates(replace(loop, shape=shape), [1.0])[0]
    return shape * np.tile(PAPER_RATE / slowest, 3)


def _input_error_response(loop: PeriodicLoop, omega: np.ndarray) -> np.ndarray:
    """Response of e_u to an error of d_hat, joint by joint, shape (frequencies, n)."""
    robot = loop.joints
    diagram = PeriodicLoop(robot, loop.pe).diagram()
    system = transfer(diagram, "model.theta_hat", cut=robot.theta, output="e_u")
    response = system(1j * omega)
    return np.array([response[k, 2 * robot.n + k] for k in range(robot.n)]).T
