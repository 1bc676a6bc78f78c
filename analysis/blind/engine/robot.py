"""Robots drawn at random: what an engineer knows of them, and what they truly are."""

from dataclasses import dataclass, replace

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import G, healthy_parameters
from clie_blocks.analysis.blind.engine.spatial_links import (
    MASS_TOLERANCE,
    Layout,
    SpatialLinks,
    draw_links,
)

PERIODS = (1e-3,) * 6 + (5e-4, 2e-3)  # s
DISCRETISATIONS = ("tustin", "tustin", "zoh", "backward", "matched")
CARRYING = (0.7, 80.0)  # rotor over link inertia of a spatial arm
GEARS_IN_SPACE = (30.0, 160.0)  # of an articulated arm
ROTORS_IN_SPACE = (0.2, 3.0)  # rotor over link inertia of an articulated arm
SAG = 0.3  # rad, at most, under the weight of the stretched links
SAG_IN_SPACE = 0.08  # rad, at most, of an articulated arm
SIZES = {  # number of joints
    "pendulum": (1,), "arm": (2,) * 10 + (3,) * 4 + (4, 5, 6),
    "axes": (1, 1, 2, 2, 2, 2, 3, 3, 3, 4, 5, 6), "spatial": (3,)}
ARTICULATED = "articulated"
DRIVES_ALONE = "drives"
LINKS_UNSTATED = ("axes", "spatial", DRIVES_ALONE)  # but for drives alone, as a part of the rotors


@dataclass(frozen=True, eq=False)
class DrawnRobot:
    """What an engineer would write into ``robot.toml``; arrays have shape (n,).

    Parameters
    ----------
    kind : str
        ``arm`` (two to six links), ``pendulum`` (one link), ``axes`` (joints side by side),
        ``spatial`` (a vertical axis that carries two links, balanced against their weight) or
        ``articulated`` (four to seven joints in space, stated by a model file), or ``drives``,
        of which only these are stated.
    period : float
        Of the controller and the logs [s].
    gravity : bool
        The links hang in gravity, and the nominal model contains it.
    coupling : bool
        The nominal model contains the coupling of the links.
    ratio, rotor, drag : ndarray
        Gear ratio; rotor inertia [kg m^2] and damping [N m s] of the datasheet, motor side.
    length, mass, com, inertia, bearing : ndarray
        Links: [m], [kg], [m], [kg m^2] about the centre of mass, [N m s] joint side.
    pose : ndarray
        Centre of the motions [rad].
    kp, kd : ndarray
        Gains, motor side [N m/rad, N m s/rad].
    corners : tuple of float
        High-pass and low-pass corner of the velocity filter [rad/s].
    discretisation : str
        Of that filter.
    command_step, resolution, sigma : ndarray
        Rounding of the command [N m] and of the position [rad]; sensor noise [rad].
    shaft : float
        Turns of the encoder's shaft per joint turn.
    encoder_on_motor : bool
        The encoder sees the motor, before a soft or loose gear.
    two_encoders : bool
        Motor and link have an encoder each, and the log keeps both.
    links : SpatialLinks, optional
        Those of an articulated arm; then `length`, `mass`, `com` and `inertia` are sizes alone.

    """

    kind: str
    period: float
    gravity: bool
    coupling: bool
    ratio: np.ndarray
    rotor: np.ndarray
    drag: np.ndarray
    length: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    bearing: np.ndarray
    pose: np.ndarray
    kp: np.ndarray
    kd: np.ndarray
    corners: tuple[float, float]
    discretisation: str
    command_step: np.ndarray
    resolution: np.ndarray
    sigma: np.ndarray
    shaft: float
    encoder_on_motor: bool = False
    two_encoders: bool = False
    links: SpatialLinks | None = None

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.ratio)

    @property
    def link(self) -> np.ndarray:
        """Diagonal of the mass matrix of the links at the pose, shape (n,) [kg m^2]."""
        if self.links is not None:
            return self.links.diagonal(self.pose)
        return link_inertia(self.kind, self.length, self.mass, self.com, self.inertia, self.pose)

    @property
    def floor(self) -> np.ndarray:
        """RMS of noise and rounding of the measured position, shape (n,) [rad]."""
        return np.sqrt(self.sigma**2 + self.resolution**2 / 12)


def link_inertia(kind: str, length: np.ndarray, mass: np.ndarray, com: np.ndarray,
                 inertia: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Diagonal of the mass matrix of the links at a pose, shape (n,) [kg m^2]."""
    if kind == "axes":
        return inertia + mass * com**2
    spatial = kind == "spatial"
    n, turned = len(length), np.cumsum(pose) - spatial * pose[0]
    along = np.stack([np.cos(turned), np.sin(turned)])
    diagonal = np.zeros(n)
    for i in range(n):
        arms = np.where(np.arange(n) == i, com, length)[:i + 1] * along[:, :i + 1]
        for k in range(i + 1):
            reach = arms[:, k:].sum(axis=1)
            if spatial and k == 0:  # about the vertical
                reach = reach[:1]
            diagonal[k] += mass[i] * reach @ reach + inertia[i]
    return diagonal


def draw_robot(rng: np.random.Generator, kind: str | None = None, gravity: bool | None = None,
               coupling: bool = True) -> DrawnRobot:
    """Draw a robot as an engineer knows it.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    kind : str, optional
        See `DrawnRobot`; by default drawn.
    gravity : bool, optional
        Whether the links hang in gravity; by default drawn.
    coupling : bool
        The nominal model of an arm contains its coupling.

    """
    kind = kind or str(rng.choice(["arm", "arm", "pendulum", "axes"]))
    if kind == ARTICULATED:
        return draw_articulated(rng)
    n = int(rng.choice(SIZES[kind]))
    gravity = bool(rng.random() < 0.5) if gravity is None else gravity
    gravity = gravity and kind not in LINKS_UNSTATED
    length = rng.uniform(0.2, 0.6, n) * np.sqrt(2 / max(n, 2))
    mass = rng.uniform(0.3, 1.5, n) * (0.5 if n <= 3 else 0.7) ** np.arange(n)
    com = length * rng.uniform(0.4, 0.9, n)
    inertia = mass * length**2 * rng.uniform(0.03, 0.08, n)
    pose = rng.uniform(-1.6, 0.9, n) * np.where(np.arange(n) > 0, 0.5, 1.0)
    ratio = np.round(np.exp(rng.uniform(0.0, np.log(200.0), n)), 1)
    link = link_inertia(kind, length, mass, com, inertia, pose)
    light = 0.7 if n <= 3 else 1.5  # share of the rotors; the coupling of long arms stays tame
    low, high = (light, 8.0) if kind != "spatial" else CARRYING
    rotor = _three_digits(link * np.exp(rng.uniform(np.log(low), np.log(high), n)) / ratio**2)
    whole = rotor * ratio**2 + link
    damping = whole * rng.uniform(0.6, 4.0, n)
    bearing = _three_digits(damping * rng.uniform(0.1, 0.4, n))
    if kind in LINKS_UNSTATED:
        rotor, bearing = _three_digits(whole / ratio**2), np.zeros(n)
    drag = _three_digits((damping - bearing) / ratio**2)
    speed = rng.uniform(4.0, 9.0, n) * (1.3 if gravity else 1.0)
    if gravity:  # tuned to carry its own weight
        speed = np.maximum(speed, np.sqrt(_weight(length, mass, com) / (SAG * whole)))
    kp = _three_digits(whole * speed**2 / ratio)
    kd = _three_digits((2 * rng.uniform(0.8, 1.2, n) * whole * speed - 0.5 * damping) / ratio)
    return DrawnRobot(
        kind, float(rng.choice(PERIODS)), gravity, coupling and kind == "arm", ratio, rotor, drag,
        length, mass, com, inertia, bearing, np.round(pose, 2), kp, kd,
        (float(rng.choice([150.0, 200.0, 240.0])), float(rng.choice([250.0, 300.0, 400.0]))),
        str(rng.choice(DISCRETISATIONS)),
        _round_down_to_125(kp * 4e-4), np.full(n, rng.choice([2e-5, 4e-5, 5e-5, 1e-4])),
        rng.uniform(0.8e-4, 2.2e-4, n), float(rng.choice([8, 10, 12, 16, 20, 24])))


def draw_articulated(rng: np.random.Generator, layout: Layout | None = None) -> DrawnRobot:
    """Draw an arm in space, which hangs in gravity and whose links couple."""
    links, pose = draw_links(rng, layout)
    n, length = links.n, np.linalg.norm(links.end, axis=1)
    link = links.diagonal(pose)
    (low, high), (light, heavy) = np.log(GEARS_IN_SPACE), np.log(ROTORS_IN_SPACE)
    ratio = np.round(np.exp(rng.uniform(low, high, n)))
    rotor = _three_digits(link * np.exp(rng.uniform(light, heavy, n)) / ratio**2)
    whole = rotor * ratio**2 + link
    damping = whole * rng.uniform(0.6, 4.0, n)
    drag = _three_digits(damping / ratio**2)
    weight = links.largest_weight(rng, pose, 0.5)
    speed = np.maximum(rng.uniform(6.0, 12.0, n), np.sqrt(weight / (SAG_IN_SPACE * whole)))
    kp = _three_digits(whole * speed**2 / ratio)
    kd = _three_digits((2 * rng.uniform(0.8, 1.2, n) * whole * speed - 0.5 * damping) / ratio)
    return DrawnRobot(
        ARTICULATED, float(rng.choice(PERIODS)), True, True, ratio, rotor, drag, length,
        links.mass, np.linalg.norm(links.com, axis=1), links.inertia.max(axis=1), np.zeros(n),
        pose, kp, kd, (200.0, float(rng.choice([250.0, 300.0, 400.0]))),
        str(rng.choice(DISCRETISATIONS)), _round_down_to_125(kp * 4e-4),
        np.full(n, rng.choice([2e-5, 4e-5, 5e-5])), rng.uniform(2e-5, 1e-4, n),
        float(rng.choice([8, 10, 12, 16, 20, 24])), links=links)


def draw_truth(rng: np.random.Generator, robot: DrawnRobot) -> dict[str, np.ndarray]:
    """Draw the robot's true parameters within the tolerances of its datasheet."""
    truth = healthy_parameters(robot.n)
    truth["rotor"] = robot.rotor * (1 + 0.01 * rng.uniform(-1, 1, robot.n))
    truth["drag"] = robot.drag * (1 + 0.15 * rng.uniform(-1, 1, robot.n))
    truth["offset"] = 0.01 * robot.kp * rng.uniform(-1, 1, robot.n)
    if robot.kind == "arm" and not robot.coupling:
        truth["links"] = np.zeros(robot.n)
    if robot.links is not None:
        truth["heavier"] = MASS_TOLERANCE * rng.uniform(-1, 1, robot.n)
    return truth


def restate_links(robot: DrawnRobot, truth: dict[str, np.ndarray]) -> DrawnRobot:
    """Return the robot with a datasheet that holds the share of the links that is really there.

    Only an arm whose coupling is hidden has another share than one: its links are lighter than
    drawn, its rotors heavier, and every joint turns the same inertia as before.
    """
    share = truth["links"][0]
    if robot.coupling or robot.kind != "arm":
        return robot
    return replace(robot, mass=share * robot.mass, inertia=share * robot.inertia,
                   rotor=robot.rotor + (1 - share) * robot.link / robot.ratio**2)


def _weight(length: np.ndarray, mass: np.ndarray, com: np.ndarray) -> np.ndarray:
    """Torque of the weight of the stretched links at each joint [N m]."""
    reach = np.concatenate(([0.0], np.cumsum(length)[:-1]))
    return np.array([G * np.sum(mass[k:] * (reach[k:] - reach[k] + com[k:]))
                     for k in range(len(mass))])


def _three_digits(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.3g}") for value in values])


def _round_down_to_125(values: np.ndarray) -> np.ndarray:
    """Largest 1, 2 or 5 times a power of ten that is not above a value."""
    tens = 10.0 ** np.floor(np.log10(values))
    lead = values / tens
    return np.round(np.where(lead >= 5, 5, np.where(lead >= 2, 2, 1)) * tens, 12)
