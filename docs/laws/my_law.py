"""The control law of an arm of two joints: PID with feedforward of a weight, 1 kHz.

    u = kp (q_d - q) + ki sum(q_d - q) T + kd d(q_d - q)/dt + weight cos(q) + pe

with the integral held where the command meets its limit.
"""

import control as ct
import numpy as np

JOINTS, PERIOD, LIMIT = 2, 1e-3, 0.8  # -, s, N m
GAINS = {"kp": np.array([1.8, 0.5]), "ki": np.array([9.0, 2.5]), "kd": np.array([0.12, 0.05]),
         "weight": np.array([0.18, 0.05])}


def _command(x, u, params):
    """Command before its limit, and the error of the position."""
    q_d, q, pe = u[:JOINTS], u[JOINTS:2 * JOINTS], u[2 * JOINTS:]
    integral, last = x[:JOINTS], x[JOINTS:]
    error = q_d - q
    return (params["kp"] * error + params["ki"] * integral
            + params["kd"] * (error - last) / PERIOD + params["weight"] * np.cos(q) + pe), error


def update(t, x, u, params):
    """Integral and error, one sample later."""
    command, error = _command(x, u, params)
    free = np.abs(command) < LIMIT
    return np.concatenate((x[:JOINTS] + np.where(free, PERIOD * error, 0.0), error))


def output(t, x, u, params):
    """Command, within its limit."""
    return np.clip(_command(x, u, params)[0], -LIMIT, LIMIT)


controller = ct.nlsys(
    update, output, name="pid", dt=PERIOD, states=2 * JOINTS, params=GAINS,
    inputs=[f"{name}[{k}]" for name in ("q_d", "q", "pe") for k in range(JOINTS)],
    outputs=[f"u[{k}]" for k in range(JOINTS)])
