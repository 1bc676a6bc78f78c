"""Regressors (13), (22), (36) and the update laws (27), (40)."""

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint
from clie_blocks.signals import DiagramError, signals, vector


def regressor_matrix(dq: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Regressor of one loop, eqs. (13) and (22), shape (3n, n): ``ddq = -Phi^T Theta``."""
    return np.vstack((np.diag(dq), -np.diag(u), np.eye(len(dq))))


def filtered_regressor_matrix(dq_f: np.ndarray, u_f: np.ndarray, omega_f: PerJoint,
                              t: float) -> np.ndarray:
    """Filtered regressor, eq. (36), shape (3n, n); its last block is the filtered constant 1."""
    ramp = 1.0 - np.exp(-omega_f * t)
    return np.vstack((np.diag(dq_f), -np.diag(u_f), ramp * np.eye(len(dq_f))))


def gradient_rate(phi: np.ndarray, e_u: np.ndarray, gamma: PerJoint, kp: PerJoint,
                  kd: PerJoint) -> np.ndarray:
    """Update law, eq. (27): ``dTheta_hat/dt = -Gamma Phi Kd Kp^-1 e_u``."""
    return -_times(gamma, phi @ (kd / kp * e_u))


def composite_rate(phi: np.ndarray, e_u: np.ndarray, phi_f: np.ndarray, e_f: np.ndarray,
                   gamma: PerJoint, alpha: PerJoint, kp: PerJoint, kd: PerJoint) -> np.ndarray:
    """Composite update law, eq. (40): (27) plus ``alpha Gamma Phi_f e_f``."""
    return gradient_rate(phi, e_u, gamma, kp, kd) + alpha * _times(gamma, phi_f @ e_f)


def regressor(n: int, *, name: str = "regressor") -> ct.NonlinearIOSystem:
    """Regressor of the estimated model, eq. (22): free of measurement noise.

    Inputs: dq [rad/s], u [N m].  Outputs: phi, shape (3n, n), flat and row-major.  No state.

    Parameters
    ----------
    n : int
        Number of joints.
    name : str
        Name of the block.

    """
    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        dq, torque = u.reshape(2, n)
        return regressor_matrix(dq, torque).reshape(-1)

    return ct.nlsys(None, output, dt=None, name=name, inputs=signals("dq", "u", n=n),
                    outputs=signals("phi", n=3 * n * n))


def filtered_regressor(n: int, *, omega_f: float = 300.0,
                       name: str = "filtered_regressor") -> ct.NonlinearIOSystem:
    """Regressor of the filtered robot, eq. (36).

    Inputs: dq_f [rad/s], u_f [N m].  Outputs: phi_f, shape (3n, n), flat.  No state.

    Parameters
    ----------
    n : int
        Number of joints.
    omega_f : float
        Corner frequency of the filters G2 [rad/s]; the key is ``'{name}.omega_f'``.
    name : str
        Name of the block.

    Notes
    -----
    The entry ``1 - exp(-omega_f t)`` assumes that filter and robot start at time 0 from rest.

    """
    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        dq_f, u_f = u.reshape(2, n)
        return filtered_regressor_matrix(dq_f, u_f, params[f"{name}.omega_f"], t).reshape(-1)

    return ct.nlsys(None, output, dt=None, name=name, params={f"{name}.omega_f": float(omega_f)},
                    inputs=signals("dq_f", "u_f", n=n), outputs=signals("phi_f", n=3 * n * n))


def identification_error(n: int, *, name: str = "identification_error") -> ct.NonlinearIOSystem:
    """Identification error, eqs. (37), (38): ``e_f = -Phi_f^T Theta_hat - y_f``.

    Inputs: phi_f (flat), theta_hat (3n,), y_f [rad/s^2].  Outputs: e_f [rad/s^2].  No state.

    Parameters
    ----------
    n : int
        Number of joints.
    name : str
        Name of the block.

    """
    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        phi_f, theta_hat, y_f = np.split(u, [3 * n * n, 3 * n * n + 3 * n])
        return -(phi_f.reshape(3 * n, n).T @ theta_hat) - y_f

    return ct.nlsys(
        None, output, dt=None, name=name, outputs=signals("e_f", n=n),
        inputs=(signals("phi_f", n=3 * n * n) + signals("theta_hat", n=3 * n)
                + signals("y_f", n=n)))


def gradient_update(gamma: ArrayLike, kp: ArrayLike, kd: ArrayLike, *, period: float | None = None,
                    name: str = "update") -> ct.NonlinearIOSystem:
    """Update law, eq. (27).

    Inputs: e_u [N m], phi (flat).  Outputs: theta_hat (3n,) = [a_hat, b_hat, d_hat].
    State: theta_hat.

    Parameters
    ----------
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain, positive definite; a vector is its diagonal.  Key ``'{name}.gamma'``.
    kp, kd : array_like, shape (n,)
        The gains of both loops (shared keys).
    period : float, optional
        Sample time [s] of a discrete-time update, one Euler step a sample.
    name : str
        Name of the block.

    Raises
    ------
    DiagramError
        If gamma is not positive definite or a gain is not positive.

    """
    kp, kd, n = _update_gains(kp, kd, name)

    def update(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        e_u, phi = u[:n], u[n:].reshape(3 * n, n)
        rate = gradient_rate(phi, e_u, params[f"{name}.gamma"], params["kp"], params["kd"])
        return rate if period is None else x + period * rate

    return ct.nlsys(
        update, _state, dt=period or 0, name=name, states=signals("theta_hat", n=3 * n),
        inputs=signals("e_u", n=n) + signals("phi", n=3 * n * n),
        outputs=signals("theta_hat", n=3 * n),
        params={f"{name}.gamma": adaptation_gain(gamma, n, name), "kp": kp, "kd": kd})


def composite_update(gamma: ArrayLike, alpha: float, kp: ArrayLike, kd: ArrayLike, *,
                     period: float | None = None, name: str = "update") -> ct.NonlinearIOSystem:
    """Composite update law, eq. (40).

    Inputs: e_u [N m], phi (flat), e_f [rad/s^2], phi_f (flat).
    Outputs: theta_hat (3n,) = [a_hat, b_hat, d_hat].  State: theta_hat.

    Parameters
    ----------
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain, positive definite; a vector is its diagonal.  Key ``'{name}.gamma'``.
    alpha : float
        Gain of the gradient method, not negative; zero gives (27).  Key ``'{name}.alpha'``.
    kp, kd : array_like, shape (n,)
        The gains of both loops (shared keys).
    period : float, optional
        Sample time [s] of a discrete-time update, one Euler step a sample.
    name : str
        Name of the block.

    Raises
    ------
    DiagramError
        If gamma is not positive definite, alpha is negative or a gain is not positive.

    Notes
    -----
    Theorem 3 holds without noise.  With noise in the filtered signals the second term pulls the
    estimates away, the more the larger alpha is.

    """
    kp, kd, n = _update_gains(kp, kd, name)
    alpha = vector(alpha, f"{name}: alpha", n=1, least=0).item()

    def update(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        sizes = np.cumsum([n, 3 * n * n, n])
        e_u, phi, e_f, phi_f = np.split(u, sizes)
        rate = composite_rate(
            phi.reshape(3 * n, n), e_u, phi_f.reshape(3 * n, n), e_f,
            params[f"{name}.gamma"], params[f"{name}.alpha"], params["kp"], params["kd"])
        return rate if period is None else x + period * rate

    return ct.nlsys(
        update, _state, dt=period or 0, name=name, states=signals("theta_hat", n=3 * n),
        inputs=(signals("e_u", n=n) + signals("phi", n=3 * n * n)
                + signals("e_f", n=n) + signals("phi_f", n=3 * n * n)),
        outputs=signals("theta_hat", n=3 * n),
        params={f"{name}.gamma": adaptation_gain(gamma, n, name), f"{name}.alpha": alpha,
                "kp": kp, "kd": kd})


def scaled_gain(phi: ArrayLike, rate: float, kp: ArrayLike, kd: ArrayLike,
                b: ArrayLike) -> np.ndarray:
    """Diagonal adaptation gain that lets every estimate converge at about the same rate.

    Below the bandwidth of the loop the averaged estimates of (27) obey ``dTheta_err/dt = -Gamma
    mean(Phi Phi^T) Kd Kp^-1 B^-1 Theta_err``; the gain makes the diagonal of that matrix `rate`.

    Parameters
    ----------
    phi : array_like, shape (samples, 3n, n)
        Regressors (13) along a motion.
    rate : float
        Wanted rate [1/s]; keep it well below the bandwidth of the loop.
    kp, kd : array_like, shape (n,)
        PD gains [N m/rad], [N m s/rad].
    b : array_like, shape (n,)
        Rough values of B [1/(kg m^2)]; the order of magnitude is enough.

    Returns
    -------
    ndarray, shape (3n,)
        Diagonal of Gamma.

    """
    weight = np.tile(np.asarray(kd) / (np.asarray(kp) * np.asarray(b)), 3)
    return rate / (np.mean(np.sum(np.square(phi), axis=2), axis=0) * weight)


def adaptation_gain(gamma: ArrayLike, n: int, name: str = "update") -> np.ndarray:
    """Check an adaptation gain Gamma: positive definite, one of the three accepted shapes.

    Parameters
    ----------
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Scalar, diagonal or full matrix.
    n : int
        Number of joints.
    name : str
        What the message calls the block.

    Returns
    -------
    ndarray
        The gain in the shape in which it came.

    Raises
    ------
    DiagramError
        If it is not symmetric positive definite or of another shape.

    """
    gamma = np.array(gamma, float)
    if gamma.shape not in ((), (3 * n,), (3 * n, 3 * n)):
        raise DiagramError(f"{name}: gamma needs shape (), ({3 * n},) or ({3 * n}, {3 * n}) for "
                           f"{n} joints, got {gamma.shape}")
    if not np.array_equal(gamma, gamma.T):
        raise DiagramError(f"{name}: gamma must be symmetric; use (gamma + gamma.T) / 2")
    smallest = np.min(np.linalg.eigvalsh(gamma) if gamma.ndim == 2 else gamma)
    if not smallest > 0:
        raise DiagramError(f"{name}: gamma must be positive definite, its smallest eigenvalue is "
                           f"{smallest:g}")
    return gamma


def _update_gains(kp: ArrayLike, kd: ArrayLike, name: str) -> tuple[np.ndarray, np.ndarray, int]:
    kp = vector(kp, f"{name}: kp", above=0)
    return kp, vector(kd, f"{name}: kd", n=kp.size, above=0), kp.size


def _times(gamma: PerJoint, direction: np.ndarray) -> np.ndarray:
    return gamma @ direction if np.ndim(gamma) == 2 else gamma * direction


def _state(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, np.ndarray]) -> np.ndarray:
    return x
