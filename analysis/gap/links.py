"""Known rigid-body terms of a planar chain of links, over whole time series.

Angles as in the paper: q1 = 0 is horizontal, q2 relative to link 1.  Torques are joint side [N m];
the mass matrix is that of all links, without the rotors.  One or two links are known in closed
form; a robot with more joints is treated joint by joint, without link terms.
"""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class PlanarChain:
    """Links of the robot, and which of their terms the nominal model holds.

    Parameters
    ----------
    length, mass, com, inertia, bearing_damping : ndarray, shape (n,)
        As in `Links`; zero where not stated.
    g : float
        Acceleration of gravity [m/s^2].
    has_gravity, has_coupling : bool
        Terms of the nominal model.
    diagonal : ndarray, shape (n,)
        Diagonal of the mass matrix at the pose of the experiments [kg m^2].
    known : bool
        The link data are stated.

    """

    length: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    bearing_damping: np.ndarray
    g: float
    has_gravity: bool
    has_coupling: bool
    diagonal: np.ndarray
    known: bool

    numbers = ("length", "mass", "com", "inertia", "bearing_damping", "g", "diagonal")

    @property
    def n(self):
        """Number of joints."""
        return len(self.length)


def planar_chain(robot, pose):
    """Return the chain that a robot file states, with its inertia at a pose."""
    links, n = robot.links, robot.n
    known = (links.mass is not None and links.length is not None and n <= 2
             and np.all(links.mass > 0) and np.all(links.length > 0))
    zero = np.zeros(n)

    def given(name):
        value = getattr(links, name)
        return zero if value is None else np.array(value, float)

    chain = PlanarChain(
        length=given("length"), mass=given("mass") if known else zero, com=given("com"),
        inertia=given("inertia") if known else zero,
        bearing_damping=given("joint_viscous_friction"), g=robot.nominal.g,
        has_gravity=known and robot.nominal.gravity,
        has_coupling=known and robot.nominal.coupling and n == 2, diagonal=zero, known=known)
    return dataclasses.replace(chain, diagonal=_diagonal(chain, np.asarray(pose, float)))


def _diagonal(chain, pose):
    if chain.n == 1:
        return chain.inertia + chain.mass * chain.com**2
    if chain.n > 2:
        return np.zeros(chain.n)
    m_11, _, m_22 = mass_entries(chain, pose[1])
    return np.array([m_11, m_22])


def mass_entries(chain, q2):
    """Entries m_11, m_12, m_22 of the mass matrix of two links [kg m^2]."""
    m, c, inertia, l_1 = chain.mass, chain.com, chain.inertia, chain.length[0]
    k = m[1] * l_1 * c[1] * np.cos(q2)
    m_22 = inertia[1] + m[1] * c[1] * c[1]
    m_11 = inertia[0] + m[0] * c[0] * c[0] + m[1] * l_1 * l_1 + m_22 + 2 * k
    return m_11, m_22 + k, m_22


def gravity_torque(chain, q, shift=0.0):
    """Weight of the links [N m]; `shift` = pi/2 turns gravity by a quarter; q has n columns."""
    own = chain.g * chain.mass * chain.com
    if chain.n == 1:
        return own[0] * np.cos(q + shift)
    carried = chain.g * chain.mass[1] * chain.length[0]
    first = (own[0] + carried) * np.cos(q[..., 0] + shift)
    tip = own[1] * np.cos(q[..., 0] + q[..., 1] + shift)
    return np.stack([first + tip, tip], axis=-1)


def coriolis_torque(chain, q, dq):
    """Coriolis and centrifugal torque of two links [N m]; zero for one."""
    if chain.n != 2:
        return 0.0 * q
    k = chain.mass[1] * chain.length[0] * chain.com[1] * np.sin(q[..., 1])
    return np.stack([-k * (2 * dq[..., 0] * dq[..., 1] + dq[..., 1] * dq[..., 1]),
                     k * dq[..., 0] * dq[..., 0]],
                    axis=-1)


def coupling_torque(chain, q, dq, ddq):
    """Torque of inertia coupling, of the change of inertia, and Coriolis [N m]."""
    if chain.n != 2:
        return 0.0 * q
    m_11, m_12, m_22 = mass_entries(chain, q[..., 1])
    inertial = np.stack([(m_11 - chain.diagonal[0]) * ddq[..., 0] + m_12 * ddq[..., 1],
                         m_12 * ddq[..., 0] + (m_22 - chain.diagonal[1]) * ddq[..., 1]], axis=-1)
    return inertial + coriolis_torque(chain, q, dq)


def tip_load_torque(chain, q, dq, ddq):
    """Torque of a unit mass at the tip [N m/kg], with its weight where gravity acts."""
    unit = unit_tip_chain(chain)
    if chain.n == 1:
        torque = unit.length[0] ** 2 * ddq
    else:
        m_11, m_12, m_22 = mass_entries(unit, q[..., 1])
        torque = np.stack([m_11 * ddq[..., 0] + m_12 * ddq[..., 1],
                           m_12 * ddq[..., 0] + m_22 * ddq[..., 1]], axis=-1)
        torque = torque + coriolis_torque(unit, q, dq)
    return torque + gravity_torque(unit, q) if chain.has_gravity else torque


def unit_tip_chain(chain):
    """Chain with the same lengths whose only mass is 1 kg at the tip."""
    return dataclasses.replace(chain, mass=np.eye(chain.n)[-1], com=chain.length,
                               inertia=np.zeros(chain.n))
