"""The load between two sets of logs of one robot, from the torques that it takes.

Both sides share one model of links and rotors; friction and offset are free on each, since a load
changes them, too.  What the loaded side takes beyond is the torque of a mass on the last link.  No
effect is searched and no motion simulated: a difference of two torques needs neither.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.load_comparison.motion import (
    SLOW,
    Motion,
    filtered,
    motions,
    top_speed,
)
from clie_blocks.analysis.gap.load_comparison.point_mass import (
    MONOMIALS,
    monomials,
    torque_columns,
)
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.errors import NotIdentifiableError, RecordError
from clie_blocks.robot_loop.links import Links, planar_links

BLOCK = 2.0  # s, within which errors of the torque are correlated
RANK = 1e-6  # of the largest singular value: below it, columns are one
EXPLAINED = 0.5  # share of the difference that a load must explain to be the answer
RIDGE = 1e-4  # pulls coordinates that no torque shows to where they began [share of the torque]
ROUNDS = 6  # in which samples that no motion explains are left out
OUTLIER = 4.0  # standard deviations from which on a sample is one of these
MAD = 0.6745  # median of the absolute value of a standard normal variable
FRICTION = 3  # columns of each joint and side: viscous, dry, offset


@dataclasses.dataclass(frozen=True, eq=False)
class LoadDifference:
    """What the loaded robot carries beyond the unloaded one.

    Parameters
    ----------
    mass, mass_half : float
        Mass, and half width of its 95 % interval [kg].
    place, place_half : ndarray, shape (3,)
        Where it sits in the frame of the last link, whose origin is its joint [m].
    distance, distance_half : float
        From the axis of the last joint [m].
    moment, moment_half : float
        Mass times distance, known better than either [kg m].
    explained : float
        Share of the difference of the torques that the load explains.
    friction : ndarray, shape (2, n, 3)
        Viscous and dry friction and offset of each joint, loaded and unloaded.
    joints : tuple of str
        Their names.

    """

    mass: float
    mass_half: float
    place: np.ndarray
    place_half: np.ndarray
    distance: float
    distance_half: float
    moment: float
    moment_half: float
    explained: float
    friction: np.ndarray
    joints: tuple[str, ...]

    @property
    def is_load(self) -> bool:
        """Whether the difference is a load: one that is not zero, and explains it."""
        return abs(self.moment) > self.moment_half and self.explained >= EXPLAINED

    def to_dict(self) -> dict[str, Any]:
        """Answer in plain JSON types."""
        return {"schema_version": 1, "verdict": "load" if self.is_load else "no load",
                "joints": list(self.joints),
                "mass": _entry(self.mass, self.mass_half, "kg"),
                "place": _entry(self.place, self.place_half, "m"),
                "distance": _entry(self.distance, self.distance_half, "m"),
                "moment": _entry(self.moment, self.moment_half, "kg m"),
                "explained": self.explained,
                "friction": {name: {"loaded": self.friction[0, :, i].tolist(),
                                    "unloaded": self.friction[1, :, i].tolist()}
                             for i, name in enumerate(("viscous", "coulomb", "offset"))}}

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__

    def _lines(self) -> list[str]:
        dry = [f"{name} {loaded:.3g} N m loaded, {unloaded:.3g} N m unloaded" for
               name, loaded, unloaded in zip(self.joints, *self.friction[..., 1])]
        friction = f"Dry friction: {'; '.join(dry)}."
        if not self.is_load:
            return [f"No load is found: mass times distance is {self.moment:.3g} +- "
                    f"{self.moment_half:.2g} kg m at {self.joints[-1]}, and a load explains "
                    f"{self.explained:.0%} of what can be one.", friction]
        return [f"The loaded robot carries {self.mass:.3g} +- {self.mass_half:.2g} kg more, "
                f"{self.distance:.3g} +- {self.distance_half:.2g} m from the axis of "
                f"{self.joints[-1]} (mass times distance {self.moment:.3g} +- "
                f"{self.moment_half:.2g} kg m)." + ("" if len(self.joints) == 1 else
                f" That explains {self.explained:.0%} of the difference of the torques."),
                friction]


def _entry(value: Any, half: Any, unit: str) -> dict[str, Any]:
    value, half = np.asarray(value, float), np.asarray(half, float)
    return {"value": value.tolist(), "interval": [(value - half).tolist(),
                                                  (value + half).tolist()], "unit": unit}


def compare_loads(loaded: Problem, unloaded: Problem) -> LoadDifference:
    """Find the load between two problems of one robot.

    Parameters
    ----------
    loaded, unloaded : Problem
        Logs of the same robot, best of the same motion.

    Raises
    ------
    RecordError
        If the robots differ.
    NotIdentifiableError
        If the logs hold no torque, or several joints move and no links are stated.

    """
    links = _links(loaded, unloaded)
    sides = [motions(problem) for problem in (loaded, unloaded)]
    speed = top_speed(sides)
    rows = [_rows(motion, links, speed, side) for side, of_side in enumerate(sides)
            for motion in of_side]
    common, load, target, blocks = (
        np.concatenate([row[i] for row in rows]) for i in range(4))
    blocks = blocks + np.repeat(np.cumsum([0, *(row[3].max() + 1 for row in rows[:-1])]),
                                [len(row[3]) for row in rows])
    usual = _usual(np.column_stack([common, load]), target)
    common, load, target, blocks = (x[usual] for x in (common, load, target, blocks))
    basis = _orthonormal(common)
    left, columns = (x - basis @ (basis.T @ x) for x in (target, load))
    start = _tip(links)
    mass, place = _fit(columns, left, start)
    slope = columns @ _slopes(mass, place)
    rest = left - columns @ (mass * monomials(place))
    spread = _spread(slope, rest, blocks)
    friction = np.linalg.lstsq(common, target - load @ (mass * monomials(place)), rcond=RANK)[0]
    return _difference(mass, place, spread, 1.0 - _excess(rest, columns, left),
                       friction[-2 * FRICTION * links.n:].reshape(2, links.n, FRICTION),
                       loaded.joints)


def _links(loaded: Problem, unloaded: Problem) -> Links:
    """Geometry of the links; a single joint needs none, whatever its angle zero is."""
    if loaded.joints != unloaded.joints:
        raise RecordError(f"the loaded robot has the joints {', '.join(loaded.joints)}, the "
                          f"unloaded one {', '.join(unloaded.joints)}; a comparison is of one")
    for problem in (loaded, unloaded):
        unit = set(problem.records[0].units["u"])
        if unit - {"N m", "N"}:
            raise NotIdentifiableError(
                f"{problem.records[0].source}: torques are in {', '.join(sorted(unit))}, so that "
                "a mass cannot be told from the gain of the drive: log a torque, or state what a "
                "unit of the command is worth ([motor] torque_constant_nm_a or torque_gain)")
    links = loaded.links
    if links.known:
        return dataclasses.replace(links, has_gravity=True)
    if loaded.n == 1:
        return planar_links([1.0], [1.0], [0.0], [0.0], has_gravity=True)
    raise NotIdentifiableError(
        f"{loaded.n} joints move and the robot file states no links, so that the torque of a load "
        "is not known: state [links] model = \"arm.urdf\", or length_m, mass_kg and com_m")


def _rows(motion: Motion, links: Links, speed: np.ndarray, side: int,
          ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Columns of both sides, columns of the load, torque and block of all rows of one log."""
    n, rows = links.n, len(motion.q)
    of_links = [torque_columns(links, k, motion.q, motion.dq, motion.ddq) for k in range(n)]
    own = np.zeros((rows, n, n + 2 * FRICTION * n))
    for k in range(n):
        own[:, k, k] = motion.ddq[:, k]
        at = n + FRICTION * (side * n + k)
        own[:, k, at:at + FRICTION] = np.stack(
            [motion.dq[:, k], np.tanh(motion.dq[:, k] / (SLOW * speed[k])), np.ones(rows)], axis=1)
    load = of_links[-1] if side == 0 else np.zeros((rows, n, MONOMIALS))
    common = np.concatenate([*of_links, own], axis=2)
    moving = motion.counted[:, None] & (np.abs(motion.dq) > SLOW * speed)
    block = np.repeat((np.arange(rows) * motion.step // BLOCK).astype(int)[:, None], n, axis=1)
    return (filtered(common, motion.step)[moving], filtered(load, motion.step)[moving],
            motion.torque[moving], block[moving])


def _usual(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Rows but for those whose torque no motion explains: impacts, slipping teeth, a limit."""
    usual = np.ones(len(target), bool)
    for _ in range(ROUNDS):
        scale = np.linalg.lstsq(columns[usual], target[usual], rcond=RANK)[0]
        error = np.abs(target - columns @ scale)
        usual = error < OUTLIER * np.median(error[usual]) / MAD
    return usual


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    """Orthonormal basis of what some columns span."""
    size = np.linalg.norm(columns, axis=0)
    left, spread, _ = np.linalg.svd(columns[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return left[:, spread > RANK * spread[0]]


def _tip(links: Links) -> np.ndarray:
    """Where the search for the load begins, in the frame of the last link [m]."""
    along = np.asarray(links.along[-1], float)
    return along if np.linalg.norm(along) > 0.0 else np.array([0.1, 0.0, 0.0])


def _fit(columns: np.ndarray, left: np.ndarray, start: np.ndarray) -> tuple[float, np.ndarray]:
    """Mass and place of the load that leaves least."""
    from scipy.optimize import least_squares

    triangle = np.asarray(np.linalg.qr(np.column_stack([columns, left]), mode="r"))
    a, b = triangle[:, :-1], triangle[:, -1]
    weight = RIDGE * np.linalg.norm(left) + 1e-300
    reach = np.linalg.norm(start)

    def error(x: np.ndarray) -> np.ndarray:
        return np.concatenate([a @ (x[0] * monomials(x[1:])) - b,
                               weight * (x[1:] - start) / reach])

    fits = []
    for side in (1.0, -1.0):
        for place in (start, 0.3 * start, np.roll(start, 1)):
            column = a @ monomials(side * place)
            mass = float(column @ b / max(column @ column, 1e-300))
            fits.append(least_squares(error, [mass, *(side * place)],
                                      x_scale=[max(abs(mass), 1e-3), reach, reach, reach]))
    best = min(fits, key=lambda fit: fit.cost)
    return float(best.x[0]), best.x[1:]


def _slopes(mass: float, place: np.ndarray) -> np.ndarray:
    """Change of the load's ten coefficients with mass and place, shape (10, 4)."""
    x, y, z = place
    of_place = np.zeros((MONOMIALS, 3))
    of_place[1:4] = np.eye(3)
    of_place[4:7] = np.diag(2.0 * place)
    of_place[7], of_place[8], of_place[9] = (y, x, 0.0), (z, 0.0, x), (0.0, z, y)
    return np.column_stack([monomials(place), mass * of_place])


def _spread(slope: np.ndarray, rest: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Covariance of mass and place, errors being correlated within blocks, shape (4, 4)."""
    size = np.linalg.norm(slope, axis=0) + 1e-300
    scaled = slope / size
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=RANK, hermitian=True)
    gradient = np.zeros((blocks.max() + 1, slope.shape[1]))
    np.add.at(gradient, blocks, scaled * rest[:, None])
    half = gradient @ inverse / size
    return half.T @ half


def _excess(rest: np.ndarray, columns: np.ndarray, left: np.ndarray) -> float:
    """Share of the difference of the two sides that a load leaves."""
    reducible = float(left @ left)
    any_rest = left - columns @ np.linalg.lstsq(columns, left, rcond=RANK)[0]
    least = float(any_rest @ any_rest)
    return float((rest @ rest - least) / max(reducible - least, 1e-300))


def _difference(mass: float, place: np.ndarray, spread: np.ndarray, explained: float,
                friction: np.ndarray, joints: Sequence[str]) -> LoadDifference:
    """Answer, with the intervals of what follows from mass and place."""
    axis = np.array([1.0, 1.0, 0.0])  # the last joint turns about z of its link
    distance = float(np.linalg.norm(axis * place))
    outward = axis * place / max(distance, 1e-300)
    to_distance = np.concatenate([[0.0], outward])
    to_moment = np.concatenate([[distance], mass * outward])
    half = NORMAL_95 * np.sqrt(np.diag(spread))
    return LoadDifference(
        mass, float(half[0]), place, half[1:], distance,
        NORMAL_95 * float(np.sqrt(to_distance @ spread @ to_distance)), mass * distance,
        NORMAL_95 * float(np.sqrt(to_moment @ spread @ to_moment)), explained, friction,
        tuple(joints))
