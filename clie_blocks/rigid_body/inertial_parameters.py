"""Inertial parameters of a tree: the regressor of its torques, and what motions show of them."""

import dataclasses

import numpy as np

from clie_blocks.rigid_body.dynamics import inverse_dynamics
from clie_blocks.rigid_body.tree import Tree

PER_LINK = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
_UPPER = np.triu_indices(3)
_SAMPLES = 60  # random motions per joint, whose torques show every parameter that acts at all
_IDLE = 1e-9  # of the largest singular value: what lies below acts on no motion


def inertial_parameters(tree: Tree) -> np.ndarray:
    """Mass, first moment and inertia about the joint of every link, (10 n,) [kg, kg m, kg m^2].

    The torques of a tree are linear in these, see `torque_regressor`.
    """
    return np.concatenate([np.concatenate(([mass], moment, inertia[_UPPER])) for
                           mass, moment, inertia in zip(tree.mass, tree.moment, tree.inertia)])


def with_inertial_parameters(tree: Tree, parameters: np.ndarray) -> Tree:
    """Return the tree with other inertial parameters, (10 n,) in the order of `PER_LINK`."""
    rows = np.reshape(parameters, (tree.n, len(PER_LINK)))
    inertia = np.zeros((tree.n, 3, 3))
    for of_link, row in zip(inertia, rows):
        of_link[_UPPER] = row[4:]
        of_link += np.triu(of_link, 1).T
    return dataclasses.replace(tree, mass=rows[:, 0], moment=rows[:, 1:4], inertia=inertia)


def torque_regressor(tree: Tree, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Regressor Y of the torques, (..., n, 10 n): inverse dynamics are Y times the parameters."""
    units = np.eye(len(PER_LINK) * tree.n)
    return np.stack([inverse_dynamics(with_inertial_parameters(tree, unit), q, dq, ddq)
                     for unit in units], axis=-1)


@dataclasses.dataclass(frozen=True, eq=False)
class BaseParameters:
    """Combinations of inertial parameters that the torques of a tree determine.

    Parameters
    ----------
    kept : tuple of int
        Parameters that lead a combination, as positions in (10 n,).
    combination : ndarray, shape (base, 10 n)
        Base parameters are ``combination @ parameters``.

    """

    kept: tuple[int, ...]
    combination: np.ndarray

    def __len__(self) -> int:
        return len(self.kept)


def base_parameters(tree: Tree, seed: int = 0) -> BaseParameters:
    """Return the base parameters of a tree, by QR with pivots of the regressor at random motions.

    A combination is led by the parameter that acts most.
    """
    from scipy.linalg import qr, solve_triangular

    rng = np.random.default_rng(seed)
    q, dq, ddq = rng.normal(size=(3, _SAMPLES * tree.n, tree.n))
    matrix = torque_regressor(tree, q, dq, ddq).reshape(-1, len(PER_LINK) * tree.n)
    triangle, order = qr(matrix, mode="r", pivoting=True)
    size = np.abs(np.diag(triangle))
    rank = int(np.sum(size > _IDLE * size[0]))
    mixed = solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:])
    combination = np.zeros((rank, matrix.shape[1]))
    combination[np.arange(rank), order[:rank]] = 1.0
    combination[:, order[rank:]] = mixed
    return BaseParameters(tuple(int(k) for k in order[:rank]), combination)
