"""What the diagnosis knows of a cause: how it acts, its parameters, and where to start looking."""

import dataclasses
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects.effect import Effect
from clie_blocks.robot_loop.dynamics import Piece
from clie_blocks.robot_loop.pieces import pieces_of

Values = Mapping[str, np.ndarray]
"""Parameter -> array (n,)."""
EffectValues = dict[str, dict[str, np.ndarray]]
"""Parameters of some effects, by name."""
Memory = list[np.ndarray]
"""Memory of a piece, one array (n,) per state."""
FrictionLimits = tuple[np.ndarray, np.ndarray]
"""Largest dry friction against forward and against backward motion, (n,) [N m]."""
BodyTerms = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Own mass (n,), mass shared with the other joints (n, n), and torque (n,), motor side."""


@dataclasses.dataclass(frozen=True)
class Number:
    """One parameter of a cause.

    Parameters
    ----------
    name, unit : str
        Its name and SI unit, motor side for torques.
    lower, upper : float
        Bounds.
    scope : str
        ``joint`` one value per joint; ``robot`` one for the robot; ``log`` one per joint and log.
    fixed : bool
        Chosen by the search, not refined by a fit.
    neutral : float or None
        Value at which the cause does nothing on a joint; None for one that does nothing on its
        own, such as a width.
    phase : bool
        It multiplies an angle or a time under a sine.
    nuisance : bool
        It says how the joint is built, not how large the cause is.
    switch : bool
        It says where the cause acts; the joints of an answer say so already.
    is_scale : bool
        It is known by its order of magnitude, such as a time or the width of a curve.
    most_torque : float or None
        Upper bound, as a multiple of the RMS command of a joint; None where the log has no say.

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
    is_scale: bool = False
    most_torque: float | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Probe:
    """A point of the search grid: shape parameters to hold, amplitudes to find by regression.

    Parameters
    ----------
    values : dict
        Parameter -> array (n,), or (logs, n) for those of scope ``log``.
    amplitudes : tuple of str
        Parameters found by regression; their values are the sizes at which columns are simulated.
        None of them: the cause as a whole is one column with coefficient one.
    sizes : dict
        Parameter -> change that has a visible effect, where it is not the value.

    """

    values: dict[str, np.ndarray]
    amplitudes: tuple[str, ...] = ()
    sizes: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True, eq=False)
class Cause:
    """One cause of a gap.

    Parameters
    ----------
    name : str
        Name in the vocabulary.
    pieces : tuple of Piece
        How it acts; all of them share the cause's parameters.
    numbers : tuple of Number
        Its parameters.
    probes : callable
        ``probes(scene)`` lists where to look; a `Scene` knows the problem and the nominal motion.
    frees : tuple of str
        Parameters of the joint model that the cause explains away, so that their datasheet
        tolerances no longer apply.
    variant : str
        Distinguishes several forms of one effect.
    needs_links : bool
        It can be searched for only where the link data are stated.
    without : tuple of str
        Name of the simpler cause that it is when some parameters are zero, or at a lower bound
        above zero, and these.
    even : tuple of str
        Name of the simpler cause that it is when two parameters are equal, and these.
    at_first_joint : str
        Name of the simpler cause that it is when it acts at the first joint only.
    held : dict of str to float
        Parameters of its effect that keep a value of their own.
    of_effect : callable or None
        ``of_effect(problem, values)``, where a search takes other parameters than its effect:
        effects of the catalogue that are the cause of a fitted model, by name, with the
        parameters of each, arrays (n,); none where no effect is the same.

    """

    name: str
    pieces: tuple[Piece, ...]
    numbers: tuple[Number, ...]
    probes: Callable[["Scene"], list[Probe]]
    frees: tuple[str, ...] = ()
    variant: str = ""
    needs_links: bool = False
    without: tuple[str, ...] = ()
    even: tuple[str, ...] = ()
    at_first_joint: str = ""
    held: Mapping[str, float] = dataclasses.field(default_factory=dict)
    of_effect: Callable[[Problem, Values], EffectValues] | None = None

    @property
    def key(self) -> str:
        """Name and variant, unique among all causes."""
        return f"{self.name}:{self.variant}" if self.variant else self.name

    @property
    def block(self) -> str:
        """The key as the name of a block."""
        return self.key.replace(":", "_").replace(".", "_")

    @property
    def moves_apart(self) -> bool:
        """Whether motor and link move apart."""
        return any(piece.port == "transmission" for piece in self.pieces)

    @property
    def shared(self) -> bool:
        """Whether one set of values holds for all joints."""
        return any(number.scope == "robot" for number in self.numbers)

    @property
    def changes_links(self) -> bool:
        """Whether it changes what the stated links weigh, or how they lean, for all joints."""
        return (self.shared and self.needs_links
                and not any(number.fixed for number in self.numbers))


def cause_of(effect: Effect, free: Collection[str], probes: Callable[["Scene"], list[Probe]],
             fixed: Collection[str] = (), per_log: Collection[str] = (),
             phase: Collection[str] = (), held: Mapping[str, float] = MappingProxyType({}),
             within: Mapping[str, tuple[float, float]] = MappingProxyType({}),
             most_torque: Mapping[str, float] = MappingProxyType({}), **how: Any) -> Cause:
    """Return an effect of the catalogue as a cause: its kernel, its parameters, where to look.

    Parameters
    ----------
    effect : Effect
        The effect.
    free : collection of str
        Parameters that a diagnosis finds.
    probes : callable
        As in `Cause`.
    fixed, per_log, phase : collection of str
        Parameters that no fit refines, that have a value for each log, and that multiply an angle
        or a time under a sine.
    held : dict of str to float
        Values of further parameters; what is in neither keeps its neutral or typical value.
    within : dict of str to (float, float)
        Narrower bounds, where a log cannot tell what lies beyond from another effect.
    most_torque : dict of str to float
        Upper bounds in RMS commands, for the same reason.
    **how
        Further fields of `Cause`.

    """
    numbers = tuple(
        Number(p.name, p.unit, *within.get(p.name, (p.lower, p.upper)),
               "log" if p.name in per_log else "joint" if p.per_joint else "robot",
               fixed=p.name in fixed, neutral=p.neutral, phase=p.name in phase,
               is_scale=p.unit == "s" or p.neutral is None and p.lower > 0.0,
               most_torque=most_torque.get(p.name))
        for p in effect.parameters if p.name in free)
    return Cause(effect.name, pieces_of(effect, free, held), numbers, probes, held=held, **how)


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """Size of the nominal motion, from which probes choose their sizes and grids.

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
    u, dq : ndarray, shape (N, n)
        Command [N m] and velocity [rad/s] of the nominal motion, all logs in turn.

    """

    problem: Problem
    torque: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    peak_torque: np.ndarray
    inertia: np.ndarray
    u: np.ndarray
    dq: np.ndarray

    @property
    def top_speed(self) -> np.ndarray:
        """Largest speed of a sine with the RMS velocity [rad/s]."""
        return np.sqrt(2.0) * self.speed

    def small_torque(self, share: float = 0.03) -> np.ndarray:
        """Torque at which a column is simulated [N m]."""
        return share * self.torque


_MOST_WAVES = 3.0  # over the travel of any joint, from which on a spectrum is sharp
_HIGHEST = 48.0  # waves per joint turn, however little a joint travels


def waves_over_travel(scene: Scene) -> list[np.ndarray]:
    """Orders of waves over the position, from half a wave over the travel up to a few waves.

    `search.ripple_spectrum` finds all higher ones.
    """
    longest, shortest = scene.travel.max(), scene.travel.min()
    least = max(3.0, 3.0 / longest)
    step = np.clip(1.2 / longest, 0.6, 3.0)
    most = max(2 * least, min(_HIGHEST, _MOST_WAVES * 2 * np.pi / shortest))
    return [order + 0 * scene.travel for order in np.arange(least, most, step)]
