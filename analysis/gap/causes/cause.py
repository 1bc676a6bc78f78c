"""What the diagnosis knows of a cause: how it acts, its numbers, and where to start looking."""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.simulation.dynamics import Piece


@dataclasses.dataclass(frozen=True)
class Number:
    """One number of a cause.

    Parameters
    ----------
    name, unit : str
        Its name and SI unit, motor side for torques.
    lower, upper : float
        Bounds.
    scope : str
        ``joint`` one value per joint; ``robot`` one for the robot; ``log`` one per joint and log.
    fixed : bool
        Chosen from the probes, not refined.
    neutral : float or None
        Value at which the cause does nothing on a joint; None for a number that does nothing on
        its own, such as a width.
    phase : bool
        It multiplies an angle or a time under a sine.
    nuisance : bool
        It says how the joint is built, not how large the cause is.
    switch : bool
        It says where the cause acts; the joints of an answer say so already.

    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    scope: str = "joint"
    fixed: bool = False
    neutral: float | None = 0.0
    phase: bool = False
    nuisance: bool = False
    switch: bool = False


@dataclasses.dataclass(frozen=True, eq=False)
class Probe:
    """A place to look: shape numbers to hold, amplitudes to find by regression.

    Parameters
    ----------
    values : dict
        Number -> array (n,), or (logs, n) for numbers of scope ``log``.
    amplitudes : tuple of str
        Numbers found by regression; their values are the sizes at which columns are simulated.
        None of them: the cause as a whole is one column with coefficient one.
    sizes : dict
        Number -> change that makes itself felt, where it is not the value.

    """

    values: dict
    amplitudes: tuple = ()
    sizes: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True, eq=False)
class Cause:
    """One cause of a gap.

    Parameters
    ----------
    name : str
        Name in the vocabulary.
    pieces : tuple of Piece
        How it acts; all of them share the cause's numbers.
    numbers : tuple of Number
        Its numbers.
    probes : callable
        ``probes(scene)`` lists where to look; a `Scene` knows the problem and the base motion.
    frees : tuple of str
        Parameters of the joint model that the cause explains away, so that what the datasheet
        says of them counts no longer.
    variant : str
        Tells apart several forms of one effect.
    needs_links : bool
        It can be asked for only where the link data are stated.
    without : tuple of str
        Name of the simpler cause that it is when a number is zero, and that number.
    even : tuple of str
        Name of the simpler cause that it is when two numbers are equal, and these.

    """

    name: str
    pieces: tuple[Piece, ...]
    numbers: tuple[Number, ...]
    probes: Callable
    frees: tuple[str, ...] = ()
    variant: str = ""
    needs_links: bool = False
    without: tuple[str, ...] = ()
    even: tuple[str, ...] = ()

    @property
    def key(self):
        """Name and variant, unique among all causes."""
        return f"{self.name}:{self.variant}" if self.variant else self.name

    @property
    def block(self):
        """The key as the name of a block."""
        return self.key.replace(":", "_")

    @property
    def shared(self):
        """Whether one set of numbers stands for all joints."""
        return any(number.scope == "robot" for number in self.numbers)


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """The base motion in numbers from which probes choose their sizes and grids.

    Parameters
    ----------
    problem : Problem
        The robot.
    torque, speed, travel : ndarray, shape (n,)
        RMS command [N m], RMS velocity [rad/s] and range of motion [rad].
    peak_torque : ndarray, shape (n,)
        Largest absolute command [N m].
    inertia : ndarray, shape (n,)
        Fitted inertia [kg m^2].

    """

    problem: object
    torque: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    peak_torque: np.ndarray
    inertia: np.ndarray

    def small_torque(self, share=0.03):
        """Torque at which a column is simulated [N m]."""
        return share * self.torque
