"""A plant with a port for extra inertia, which payload and coupling need."""

from collections.abc import Callable

import control as ct
import numpy as np

from clie_blocks.signals import DiagramError, ports, signals


def acceleration_with_inertia(free: np.ndarray, response: np.ndarray) -> np.ndarray:
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


def plant_with_inertia(plant: ct.NonlinearIOSystem) -> ct.NonlinearIOSystem:
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
    _refuse_composed(plant)
    n, rate = plant.ninputs, _rate(plant)

    def update(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
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


def refuse_heavy_motor(plant: ct.NonlinearIOSystem, transmission: ct.NonlinearIOSystem) -> None:
    """Refuse a transmission that takes more inertia out of the plant than it has.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        The plant.
    transmission : control.NonlinearIOSystem
        A block with the output `inertia`, what the plant is rid of with a minus sign [kg m^2].

    Raises
    ------
    DiagramError
        If nothing would be left to a link, or the plant has further states.

    """
    _refuse_composed(plant)
    n = plant.ninputs
    rows = ports(transmission.output_labels)["inertia"]
    at_rest = (np.zeros(transmission.nstates), np.zeros(transmission.ninputs))
    taken = transmission.output(0.0, *at_rest)[rows].reshape(n, n)
    poses = np.random.default_rng(0).uniform(-np.pi, np.pi, (16, n))
    for pose in (np.zeros(n), *poses):
        response = _accelerations(plant, pose)
        if np.min(np.linalg.eigvals(np.eye(n) + response @ taken).real) <= 0:
            own = np.diag(np.linalg.inv(response))
            raise DiagramError(
                f"{transmission.name}: motor_inertia {-np.diag(taken)} kg m^2 leaves nothing to "
                f"the link of {plant.name}, whose joints have {own} kg m^2 with their motors at "
                f"q = {pose}; give the motor's share alone")


def _accelerations(plant: ct.NonlinearIOSystem, pose: np.ndarray) -> np.ndarray:
    """Acceleration of all joints [rad/s^2] by a unit torque on each, column by column."""
    n = plant.ninputs
    rest = np.concatenate((pose, np.zeros(n)))
    free = plant.dynamics(0.0, rest, np.zeros(n))
    return np.stack([plant.dynamics(0.0, rest, unit) - free for unit in np.eye(n)], axis=1)[n:]


def _refuse_composed(plant: ct.NonlinearIOSystem) -> None:
    if plant.nstates != 2 * plant.ninputs or hasattr(plant, "syslist"):
        raise DiagramError(f"{plant.name}: extra inertia needs the bare plant with the states q, "
                           "dq; insert all effects in one call of with_effects")


def _rate(plant: ct.NonlinearIOSystem) -> Callable:
    if isinstance(plant, ct.StateSpace):
        return lambda t, x, u, params: plant.A @ x + plant.B @ u
    return plant.updfcn
