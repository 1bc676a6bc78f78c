"""A plant with a port for extra inertia, which payload and coupling need."""

import control as ct
import numpy as np

from clie_blocks.signals import DiagramError, signals


def acceleration_with_inertia(free, response):
    """Acceleration under extra inertia [rad/s^2].

    Parameters
    ----------
    free : array_like, shape (n,)
        Acceleration without the extra inertia [rad/s^2].
    response : array_like, shape (n, n)
        Column j is the acceleration caused by the torques of column j of the extra inertia.

    Notes
    -----
    From ``(M + E) ddq = M free`` follows ``(I + M^-1 E) ddq = free``.  With E = 0 the matrix is
    the identity and the result is `free`, bit for bit.

    """
    return np.linalg.solve(np.eye(free.shape[0]) + response, free)


def plant_with_inertia(plant):
    """Plant with the further input `inertia`, a matrix (n, n) in row-major order [kg m^2].

    Inputs: u [N m], inertia [kg m^2], both motor side.  Outputs: q [rad], dq [rad/s].  State: q,
    dq.  Holds for any plant whose acceleration is affine in u, linear or not; it needs n + 2
    evaluations of the plant where one was enough.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        A block with state (q, dq), in this order, and ports ``u -> q, dq``.

    Raises
    ------
    DiagramError
        If the plant has further states: the rigid-body terms are then inside it.

    """
    n = plant.ninputs
    if plant.nstates != 2 * n or hasattr(plant, "syslist"):
        raise DiagramError(f"{plant.name}: extra inertia needs the bare plant with the states q, "
                           "dq; insert all effects in one call of with_effects")
    rate = _rate(plant)

    def update(t, x, u, params):
        torque, inertia = u[:n], u[n:].reshape(n, n)
        rest = rate(t, x, np.zeros(n), params)[n:]
        response = np.stack([rate(t, x, inertia[:, j], params)[n:] - rest for j in range(n)],
                            axis=1)
        free = rate(t, x, torque, params)
        return np.concatenate((free[:n], acceleration_with_inertia(free[n:], response)))

    return ct.nlsys(
        update, lambda t, x, u, params: x, name=plant.name, params=dict(plant.params),
        inputs=signals("u", n=n) + signals("inertia", n=n * n), outputs=plant.output_labels,
        states=plant.state_labels)


def _rate(plant):
    if isinstance(plant, ct.StateSpace):
        return lambda t, x, u, params: plant.A @ x + plant.B @ u
    return plant.updfcn
