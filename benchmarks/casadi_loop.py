"""The CASE 2 loop as a CasADi graph, run by CasADi's own virtual machine."""

from collections.abc import Callable

import casadi as ca
import loop
import numpy as np

from clie_blocks.compiled import METHODS

STATES = 22


def derivative(t: ca.SX, x: ca.SX, noise: ca.SX) -> ca.SX:
    """Return the right-hand side as one expression."""
    c = loop.constants()
    pe = (0.7 * ca.sin(2 * np.pi * t) + 0.5 * ca.sin(np.pi * t) - 0.25 * ca.cos(np.pi * t))
    ramp, dx = 1.0 - ca.exp(-c["omega_f"] * t), [0] * STATES
    for j in range(2):
        q, dq, q_model, dq_model = x[j] + noise[j], x[2 + j], x[4 + j], x[6 + j]
        g1, velocity = x[8 + 2 * j], x[9 + 2 * j]
        dq_f, u_f, a_hat, b_hat, d_hat = x[12 + j], x[14 + j], x[16 + j], x[18 + j], x[20 + j]
        u = c["kp"][j] * (c["q_d"][j] - q) - c["kd"][j] * velocity + pe
        u_model = c["kp"][j] * (c["q_d"][j] - q_model) - c["kd"][j] * dq_model + pe
        y_f = c["omega_f"] * (velocity - dq_f)
        e_f = -a_hat * dq_f + b_hat * u_f - ramp * d_hat - y_f
        weighted = c["kd"][j] / c["kp"][j] * (u_model - u)
        gradient = c["alpha"] * c["gamma"] * e_f
        rate = c["highpass"] * (q - g1)
        dx[j], dx[4 + j], dx[8 + 2 * j] = dq, dq_model, rate
        dx[2 + j] = -c["a"][j] * dq + c["b"][j] * u - c["d"][j]
        dx[6 + j] = -a_hat * dq_model + b_hat * u_model - d_hat
        dx[9 + 2 * j] = c["lowpass"] * (rate - velocity)
        dx[12 + j], dx[14 + j] = y_f, c["omega_f"] * (u - u_f)
        dx[16 + j] = -c["gamma"] * dq_model * weighted + gradient * dq_f
        dx[18 + j] = c["gamma"] * u_model * weighted - gradient * u_f
        dx[20 + j] = -c["gamma"] * weighted + gradient * ramp
    return ca.vertcat(*dx)


def simulator(steps: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return ``run(noise)``, which takes so many steps and returns the last state."""
    x, t, noise = ca.SX.sym("x", STATES), ca.SX.sym("t"), ca.SX.sym("noise", 2)
    right_side = ca.Function("f", [t, x, noise], [derivative(t, x, noise)])
    method, h, k = METHODS["ode5"], loop.STEP, []
    for weights, c in zip(method.a, method.c):
        y = x + h * sum((w * rate for w, rate in zip(weights, k)), ca.SX.zeros(STATES))
        k.append(right_side(t + c * h, y, noise))
    after = x + h * sum(w * rate for w, rate in zip(method.b, k))
    step = ca.Function("step", [x, t, noise], [after]).mapaccum(steps)
    times = np.arange(steps)[None] * h
    return lambda rows: np.asarray(step(np.zeros(STATES), times, rows.T))[:, -1]
