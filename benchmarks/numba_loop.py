"""The CASE 2 loop by hand in numba: the C program, line by line."""

import loop
import numba
import numpy as np

from clie_blocks.compiled import METHODS

STATES = 22
A = np.array([[*row, *[0.0] * (6 - len(row))] for row in METHODS["ode5"].a])
B, C = np.array(METHODS["ode5"].b), np.array(METHODS["ode5"].c)


@numba.njit(error_model="numpy")
def derivative(t: float, x: np.ndarray, noise: np.ndarray, constants: tuple,
               dx: np.ndarray) -> None:
    a, b, d, kp, kd, q_d, gamma, alpha, highpass, lowpass, omega_f = constants
    pe = (0.7 * np.sin(2 * np.pi * t) + 0.5 * np.sin(np.pi * t) - 0.25 * np.cos(np.pi * t))
    ramp = 1.0 - np.exp(-omega_f * t)
    for j in range(2):
        q, dq, q_model, dq_model = x[j] + noise[j], x[2 + j], x[4 + j], x[6 + j]
        g1, velocity = x[8 + 2 * j], x[9 + 2 * j]
        dq_f, u_f, a_hat, b_hat, d_hat = x[12 + j], x[14 + j], x[16 + j], x[18 + j], x[20 + j]
        u = kp[j] * (q_d[j] - q) - kd[j] * velocity + pe
        u_model = kp[j] * (q_d[j] - q_model) - kd[j] * dq_model + pe
        y_f = omega_f * (velocity - dq_f)
        e_f = -a_hat * dq_f + b_hat * u_f - ramp * d_hat - y_f
        weighted = kd[j] / kp[j] * (u_model - u)
        gradient = alpha * gamma * e_f
        dx[j] = dq
        dx[2 + j] = -a[j] * dq + b[j] * u - d[j]
        dx[4 + j] = dq_model
        dx[6 + j] = -a_hat * dq_model + b_hat * u_model - d_hat
        dx[8 + 2 * j] = highpass * (q - g1)
        dx[9 + 2 * j] = lowpass * (highpass * (q - g1) - velocity)
        dx[12 + j] = y_f
        dx[14 + j] = omega_f * (u - u_f)
        dx[16 + j] = -gamma * dq_model * weighted + gradient * dq_f
        dx[18 + j] = gamma * u_model * weighted - gradient * u_f
        dx[20 + j] = -gamma * weighted + gradient * ramp


@numba.njit(error_model="numpy")
def run(noise: np.ndarray, h: float, every: int, constants: tuple, log: np.ndarray) -> np.ndarray:
    x, y, k = np.zeros(STATES), np.zeros(STATES), np.zeros((6, STATES))
    for s in range(len(noise)):
        t = s * h
        if s % every == 0:
            log[s // every] = x
        for i in range(6):
            for m in range(STATES):
                total = 0.0
                for j in range(i):
                    total += A[i, j] * k[j, m]
                y[m] = x[m] + h * total
            derivative(t + C[i] * h, y, noise[s], constants, k[i])
        for m in range(STATES):
            x[m] += h * (B[0] * k[0, m] + B[2] * k[2, m] + B[3] * k[3, m] + B[4] * k[4, m]
                         + B[5] * k[5, m])
    return x


def simulate(noise: np.ndarray) -> np.ndarray:
    """Run over all rows of noise; returns the last state."""
    log = np.zeros((len(noise) // loop.EVERY + 1, STATES))
    return run(noise, loop.STEP, loop.EVERY, tuple(loop.constants().values()), log)
