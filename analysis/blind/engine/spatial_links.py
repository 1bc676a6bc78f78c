"""Links of arms in space, drawn at random in the layouts of known arms."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import G

MASS_TOLERANCE = 0.05  # relative, of every link
FILES = "arm.urdf", "arm.xml"
_THICK = 0.12, 0.25  # radius of a link over its length
_POSES = 50  # at which the largest weight of a drawn arm is looked for


@dataclass(frozen=True)
class Layout:
    """Axes and links of a kind of arm; all frames are parallel where every joint reads zero.

    Parameters
    ----------
    axes : str
        Axis of each joint, x, y or z of the base.
    links : tuple of tuple
        Where each link ends, from its joint [m].
    masses : tuple of float
        Of the links [kg].
    home : tuple of float
        Pose around which the arm works [rad].

    """

    axes: str
    links: tuple[tuple[float, float, float], ...]
    masses: tuple[float, ...]
    home: tuple[float, ...]

    def first(self, n: int) -> "Layout":
        """The first n joints and their links."""
        return Layout(self.axes[:n], self.links[:n], self.masses[:n], self.home[:n])


LAYOUTS = (
    # hobby arms: a turntable, shoulder, elbow, and a wrist that bends, or bends and rolls
    Layout("zyyy", ((0.02, 0, 0.06), (0, 0, 0.14), (0.14, 0, 0), (0.10, 0, 0)),
           (0.3, 0.25, 0.2, 0.15), (0.0, 0.3, 0.3, 0.4)),
    Layout("zyyyx", ((0.03, 0, 0.06), (0.03, 0, 0.11), (0.13, 0, 0), (0.06, 0, 0), (0.09, 0, 0)),
           (0.25, 0.15, 0.12, 0.1, 0.08), (0.0, -0.2, 0.6, 0.4, 0.2)),
    # industrial arms whose last three axes nearly meet
    Layout("zyyxyx", ((0.15, 0, 0.40), (0, 0, 0.45), (0.06, 0, 0.04), (0.40, 0, 0), (0.08, 0, 0),
                      (0.07, 0, 0)), (16.0, 11.0, 7.0, 4.0, 1.5, 0.4),
           (0.0, 0.4, 0.3, 0.3, 0.7, 0.0)),
    # collaborative arms with three parallel axes
    Layout("zyyyzy", ((0, 0.13, 0.09), (0.42, -0.11, 0), (0.39, 0, 0), (0, 0.09, 0),
                      (0, 0, -0.09), (0, 0.08, 0)), (3.7, 8.4, 2.3, 1.2, 1.2, 0.3),
           (0.0, -1.0, 1.2, -0.3, 0.3, 0.2)),
    # collaborative arms of seven axes, that turn and bend in turn
    Layout("zyzyzyz", ((0, 0, 0.17), (0, 0, 0.16), (0, 0, 0.20), (0, 0, 0.18), (0, 0, 0.19),
                       (0.07, 0, 0.02), (0, 0, 0.10)), (4.0, 4.0, 3.0, 2.7, 1.7, 1.6, 0.5),
           (0.0, 0.5, 0.1, 1.2, 0.1, 0.8, 0.0)))


@dataclass(frozen=True, eq=False)
class SpatialLinks:
    """Links of an arm in space; the frame of each lies at its joint.

    Parameters
    ----------
    axis : ndarray, shape (n, 3)
        Of each joint, a unit vector.
    end : ndarray, shape (n, 3)
        Where the link ends: the next joint, or the tool [m].
    com : ndarray, shape (n, 3)
        Centre of mass [m].
    mass : ndarray, shape (n,)
        [kg].
    inertia : ndarray, shape (n, 3)
        About the axes of the frame through the centre of mass [kg m^2].
    file : str
        Name of the model file that states them, a URDF or an MJCF.

    """

    axis: np.ndarray
    end: np.ndarray
    com: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    file: str

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.mass)

    def at(self, k: int) -> np.ndarray:
        """Where joint k sits on the link before, shape (3,) [m]."""
        return self.end[k - 1] if k else np.zeros(3)

    def diagonal(self, pose: np.ndarray) -> np.ndarray:
        """Diagonal of the mass matrix at a pose, shape (n,) [kg m^2]."""
        diagonal = np.zeros(self.n)
        for axis, joint, spread, com, mass, k in self._pairs(pose):
            across = np.cross(axis, com - joint)
            diagonal[k] += mass * across @ across + axis @ spread @ axis
        return diagonal

    def weight(self, pose: np.ndarray) -> np.ndarray:
        """Torque at each joint that holds the weight, shape (n,) [N m]."""
        torque = np.zeros(self.n)
        for axis, joint, _, com, mass, k in self._pairs(pose):
            torque[k] += mass * G * np.cross(axis, com - joint)[2]
        return torque

    def largest_weight(self, rng: np.random.Generator, pose: np.ndarray, reach: float,
                       ) -> np.ndarray:
        """Largest torque of the weight within `reach` [rad] of a pose, shape (n,) [N m]."""
        poses = pose + rng.uniform(-reach, reach, (_POSES, self.n))
        return np.max([np.abs(self.weight(one)) for one in poses], axis=0)

    def _pairs(self, pose: np.ndarray) -> Iterator[tuple]:
        """Joints with each link that they move: axis, place, inertia, com, mass, and the joint."""
        turned, place = np.eye(3), np.zeros(3)
        axes, joints = [], []
        for i in range(self.n):
            place = place + turned @ self.at(i)
            axes.append(turned @ self.axis[i])
            joints.append(place)
            turned = turned @ _rotation(self.axis[i], pose[i])
            com = place + turned @ self.com[i]
            spread = turned @ np.diag(self.inertia[i]) @ turned.T
            for k in range(i + 1):
                yield axes[k], joints[k], spread, com, self.mass[i], k


def draw_links(rng: np.random.Generator, layout: Layout | None = None,
               ) -> tuple[SpatialLinks, np.ndarray]:
    """Draw links, and the pose around which the arm works [rad].

    Dimensions and masses are those of a known kind of arm, by default any of `LAYOUTS`, each a
    fifth off at most, the arm as a whole up to a third larger or smaller.
    """
    layout = layout or LAYOUTS[rng.integers(len(LAYOUTS))]
    n = len(layout.axes)
    scale = np.exp(rng.uniform(-0.3, 0.3))
    end = np.array(layout.links) * scale * rng.uniform(0.8, 1.2, (n, 1))
    mass = np.array(layout.masses) * scale**3 * rng.uniform(0.8, 1.2, n)
    length = np.linalg.norm(end, axis=1)
    com = end * rng.uniform(0.3, 0.7, (n, 1)) + 0.1 * length[:, None] * rng.uniform(-1, 1, (n, 3))
    radius = length * rng.uniform(*_THICK, n)
    along = end / length[:, None]
    slender = mass * (length**2 / 12 + radius**2 / 4)
    inertia = slender[:, None] + (mass * radius**2 / 2 - slender)[:, None] * along**2
    axis = np.eye(3)[["xyz".index(letter) for letter in layout.axes]]
    pose = np.round(np.array(layout.home) + rng.uniform(-0.4, 0.4, n), 2)
    links = SpatialLinks(axis, end.round(4), com.round(4), np.round(mass, 4),
                         np.maximum(inertia, 1e-6).round(7), str(rng.choice(FILES)))
    return links, pose


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about a unit vector."""
    x, y, z = axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
