"""The CASE 2 loop by hand as one block of Jaxonomy, compiled by JAX."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import jaxonomy
import loop
import numpy as np

STATES = 22


def derivative(time: jax.Array, state: Any, **_: Any) -> jax.Array:
    """Return the right-hand side, both joints at once."""
    c, x = loop.constants(), state.continuous_state
    q, dq, q_model, dq_model = x[0:2], x[2:4], x[4:6], x[6:8]
    g1, velocity = x[8:12:2], x[9:12:2]
    dq_f, u_f, a_hat, b_hat, d_hat = x[12:14], x[14:16], x[16:18], x[18:20], x[20:22]
    pe = (0.7 * jnp.sin(2 * jnp.pi * time) + 0.5 * jnp.sin(jnp.pi * time)
          - 0.25 * jnp.cos(jnp.pi * time))
    ramp = 1.0 - jnp.exp(-c["omega_f"] * time)
    u = c["kp"] * (c["q_d"] - q) - c["kd"] * velocity + pe
    u_model = c["kp"] * (c["q_d"] - q_model) - c["kd"] * dq_model + pe
    y_f = c["omega_f"] * (velocity - dq_f)
    e_f = -a_hat * dq_f + b_hat * u_f - ramp * d_hat - y_f
    weighted = c["kd"] / c["kp"] * (u_model - u)
    gradient = c["alpha"] * c["gamma"] * e_f
    rate = c["highpass"] * (q - g1)
    filters = jnp.stack([rate, c["lowpass"] * (rate - velocity)], axis=1).ravel()
    return jnp.concatenate([
        dq, -c["a"] * dq + c["b"] * u - c["d"],
        dq_model, -a_hat * dq_model + b_hat * u_model - d_hat, filters,
        y_f, c["omega_f"] * (u - u_f),
        -c["gamma"] * dq_model * weighted + gradient * dq_f,
        c["gamma"] * u_model * weighted - gradient * u_f,
        -c["gamma"] * weighted + gradient * ramp])


class _Loop(jaxonomy.LeafSystem):
    """The closed loop as one system without inputs."""

    def __init__(self) -> None:
        super().__init__(name="loop")
        self.declare_continuous_state(default_value=jnp.zeros(STATES), ode=derivative,
                                      requires_inputs=False)


def simulator(steps: int) -> Callable[[], np.ndarray]:
    """Return ``run()``, which takes so many steps without noise, and gives the last state."""
    system = _Loop()
    options = jaxonomy.SimulatorOptions(
        ode_solver_method="dopri5", max_minor_step_size=loop.STEP, rtol=1e30, atol=1e30,
        precision="float64")  # no error is too large, so that every step is the longest allowed
    simulation, context = jaxonomy.Simulator(system, options=options), system.create_context()
    end = steps * loop.STEP
    advance = jax.jit(lambda context: simulation.advance_to(end, context).context)
    return lambda: np.asarray(advance(context).continuous_state)
