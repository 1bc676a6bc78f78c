"""A hypothesis: the joint model with some causes at some joints, and its open numbers."""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.residual.noise import decimation
from clie_blocks.analysis.gap.residual.whitening import DIVERGED
from clie_blocks.analysis.gap.simulation.closed_loop import constants, simulator, structure

SOFTNESS = 0.25  # how far, in tolerances, a joint may stray beyond its datasheet at one sigma


@dataclasses.dataclass(frozen=True, eq=False)
class Member:
    """One cause at some joints, with the numbers from which its fit starts.

    Parameters
    ----------
    cause : Cause
        The cause.
    joints : tuple of int
        Where it acts; elsewhere it is neutral.
    values : dict
        Number -> array (n,), or (logs, n) for numbers of scope ``log``.
    sizes : dict
        Number -> a step that makes itself felt.

    """

    cause: Cause
    joints: tuple
    values: dict
    sizes: dict

    @property
    def name(self):
        """Name of the block that it becomes."""
        return self.cause.block


@dataclasses.dataclass(frozen=True)
class Open:
    """One number that a fit may move.

    Parameters
    ----------
    key : str
        Parameter of the simulator.
    joint, log : int or None
        Where it counts; None for everywhere.
    size : float
        A step that makes itself felt.
    lower, upper : float
        Bounds.
    centre, tolerance : float or None
        What the datasheet says, or None.
    phase : bool
        It moves a phase, so that its size is the only step at which a difference is a slope.

    """

    key: str
    joint: int | None
    log: int | None
    size: float
    lower: float
    upper: float
    centre: float | None = None
    tolerance: float | None = None
    phase: bool = False

    def stray(self, value):
        """How far a value lies beyond its tolerance, in sigmas."""
        if self.tolerance is None:
            return 0.0
        z = (value - self.centre) / self.tolerance
        return np.sign(z) * max(abs(z) - 1.0, 0.0) / SOFTNESS


@dataclasses.dataclass(frozen=True, eq=False)
class Hypothesis:
    """Joint model plus members, with values for all numbers.

    Parameters
    ----------
    problem : Problem
        The robot.
    members : tuple of Member
        The causes; none of them is the nominal model.
    values : dict
        Parameter of the simulator -> array (n,), or (logs, n) where it differs between logs.

    """

    problem: object
    members: tuple
    values: dict

    @functools.cached_property
    def simulator(self):
        """The closed loop of this hypothesis."""
        causes = tuple(member.cause for member in self.all_members)
        if self.problem.law.variant == "loop":
            return self.problem.law.simulator(causes)
        return simulator(structure(self.problem), causes)

    @property
    def all_members(self):
        """Causes of the hypothesis, behind those that the model holds anyway."""
        return (*self.problem.inside, *self.members)

    @functools.cached_property
    def coupled(self):
        """Whether links push each other in a loop that holds them.

        Of links that nothing holds, which fall as they like, a slope says little anyway.
        """
        problem, chain = self.problem, self.problem.chain
        pushed = chain.has_coupling or chain.has_gravity or any(
            piece.port == "body" for member in self.all_members for piece in member.cause.pieces)
        return (problem.n > 1 and pushed and problem.law.variant != "loop"
                and bool(np.all(problem.law.kp > 0)))

    def of_log(self, j, values=None):
        """Parameters of log j."""
        return {key: value[j] if value.ndim == 2 and key not in ("a", "b") else value
                for key, value in (self.values if values is None else values).items()}

    def positions(self, j, sets):
        """Positions in log j for many sets of values, shape (sets, n, N) [rad]."""
        return self.simulator.positions(self.problem.logs[j],
                                        [self.of_log(j, values) for values in sets])

    def means(self, j, sets):
        """Positions in log j averaged as errors are, for many sets of values [rad]."""
        return self.simulator.means(self.problem.logs[j],
                                    [self.of_log(j, values) for values in sets],
                                    decimation(self.problem.period))

    def error(self, j, dithered=True):
        """Measured less simulated position in log j, shape (N, n) [rad]."""
        log = self.problem.logs[j]
        q, = self.simulator.positions(log, [self.of_log(j)], dithered)
        return np.nan_to_num(np.clip(log.q - q.T, -DIVERGED, DIVERGED), nan=DIVERGED)

    def with_values(self, values):
        """Return the same hypothesis with other numbers."""
        return dataclasses.replace(self, values=values)

    @functools.cached_property
    def open(self):
        """The numbers that a fit moves."""
        held = (self._known(entry) for member in self.problem.inside
                for entry in self._of_member(member))
        return (*self._joint_model(), *held, *(entry for member in self.members
                                               for entry in self._of_member(member)))

    def _known(self, entry):
        """Number of a cause that the model holds: it may move within its size."""
        member = next(m for m in self.problem.inside if entry.key.startswith(f"{m.name}."))
        value = member.values[entry.key.removeprefix(f"{member.name}.")]
        k = member.joints[0] if entry.joint is None else entry.joint
        centre = value[entry.log, k] if entry.log is not None else value[k]
        return dataclasses.replace(entry, centre=centre, tolerance=entry.size)

    def _joint_model(self):
        given, n = self.problem.nominal, self.problem.n
        freed = {(name, k) for member in self.members for name in member.cause.frees
                 for k in member.joints}
        for name in ("inertia", "damping", "load"):
            centre, tolerance = getattr(given, name), getattr(given, f"{name}_tolerance")
            for k in range(n):
                free = (name, k) in freed
                lower = {"inertia": 0.2 * centre[k], "damping": 0.0}.get(name, -np.inf)
                yield Open(name, k, None, max(0.02 * abs(centre[k]), 0.3 * tolerance[k]),
                           lower, np.inf, centre[k], None if free else tolerance[k])

    def _of_member(self, member):
        for number in member.cause.numbers:
            if number.fixed:
                continue
            key = f"{member.name}.{number.name}"
            size = np.max(np.abs(np.atleast_2d(member.sizes[number.name])), axis=0)
            if number.scope == "robot":
                yield Open(key, None, None, size[member.joints[0]], number.lower, number.upper)
                continue
            logs = range(len(self.problem.fit)) if number.scope == "log" else (None,)
            for log in logs:
                for k in member.joints:
                    yield Open(key, k, log, size[k], number.lower, number.upper,
                               phase=number.phase)

    def get(self, entry):
        """Value of an open number."""
        value = self.values[entry.key]
        k = self.members_joint(entry) if entry.joint is None else entry.joint
        return value[entry.log, k] if entry.log is not None else value[k]

    def members_joint(self, entry):
        """First joint of the member that a number of the whole robot belongs to."""
        return next(member.joints[0] for member in self.all_members
                    if entry.key.startswith(f"{member.name}."))

    def moved(self, steps):
        """Return the values after steps on open numbers: a list of (entry, new value)."""
        values = {key: value for key, value in self.values.items()}
        for entry, value in steps:
            array = values[entry.key].copy()
            where = slice(None) if entry.joint is None else entry.joint
            array[where if entry.log is None else (entry.log, where)] = value
            values[entry.key] = array
        return values

    def stray(self):
        """Distances of the joint model from its datasheet, one per open number [sigma]."""
        return np.array([entry.stray(self.get(entry)) for entry in self.open])


def hypothesis(problem, members, base=None):
    """Return the hypothesis of some members, from the numbers of a fitted base or the nominal.

    Parameters
    ----------
    problem : Problem
        The robot.
    members : sequence of Member
        The causes.
    base : Hypothesis, optional
        Where the joint model's numbers come from.

    """
    members = tuple(members)
    values = constants(problem)
    for member in (*problem.inside, *members):
        for number in member.cause.numbers:
            value = np.array(member.values[number.name], float)
            if number.scope != "robot" and number.neutral is not None:
                idle = [k for k in range(problem.n) if k not in member.joints]
                value[..., idle] = number.neutral
            values[f"{member.name}.{number.name}"] = value
    if base is not None:
        held = {f"{m.name}.{number.name}" for m in problem.inside for number in m.cause.numbers}
        values.update({key: value for key, value in base.values.items()
                       if key in held or key in ("inertia", "damping", "load", "a", "b")})
    return Hypothesis(problem, members, values)
