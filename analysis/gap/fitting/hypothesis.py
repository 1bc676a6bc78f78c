"""A hypothesis: the joint model with some causes at some joints, and its free parameters."""

import dataclasses
import functools
import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import cast

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.causes.drive import TIME_DELAY, TORQUE_GAIN_ERROR
from clie_blocks.analysis.gap.problem.other_encoder import views_of_law
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import rows_of
from clie_blocks.analysis.gap.residual.whitening import DIVERGED, ResidualModel
from clie_blocks.analysis.gap.simulation.closed_loop import constants
from clie_blocks.analysis.gap.simulation.simulators import LoopRunner, simulator_of
from clie_blocks.processors import side_by_side
from clie_blocks.robot_loop.links import Links

Values = dict[str, np.ndarray]
"""Parameter -> array (n,), or (runs, n) where it differs between logs, see `Problem.runs`."""

DELAY_TOLERANCE = 0.02  # of a delay of one period: how well its length is known
_JOINT_MODEL = "inertia", "damping", "load"
_MATRICES = frozenset(("a", "b", *(f"links.{name}" for name in Links.parameters)))
_WEAK_COUPLING = 0.5  # of the mass of joints
TORQUE_SCALE = f"{TORQUE_GAIN_ERROR.block}.error"  # of a torque that is known with a tolerance
LINK_MASS, LINK_COM, _LINK_INERTIA = "links.mass", "links.com", "links.inertia"
_LEAST_MASS = 0.05  # of the stated one
_LEAST_INERTIA = 0.2  # of the stated one


@dataclasses.dataclass(frozen=True, eq=False)
class Member:
    """One cause at some joints, with the parameters from which its fit starts.

    Parameters
    ----------
    cause : Cause
        The cause.
    joints : tuple of int
        Where it acts; elsewhere it is neutral.
    values : dict
        Parameter -> array (n,), or (runs, n) for parameters of scope ``log``.
    sizes : dict
        Parameter -> a change that has a visible effect.

    """

    cause: Cause
    joints: tuple[int, ...]
    values: Values
    sizes: Values

    @property
    def name(self) -> str:
        """Name of the block that it becomes."""
        return self.cause.block


def held_members(problem: Problem) -> tuple[Member, ...]:
    """Effects that the nominal model holds.

    With the delay of the command that was found, and the error of a torque per command that is
    known with a tolerance.
    """
    held, joints = cast(tuple[Member, ...], problem.inside), tuple(range(problem.n))
    if problem.nominal.torque_tolerance:
        error = np.full(problem.n, problem.nominal.torque_tolerance)
        held = Member(TORQUE_GAIN_ERROR, joints, {"error": 0.0 * error}, {"error": error}), *held
    if problem.command_delay:
        delay = np.full(problem.n, problem.command_delay)
        held = Member(TIME_DELAY, joints, {"delay": delay},
                      {"delay": DELAY_TOLERANCE * delay}), *held
    return held


@dataclasses.dataclass(frozen=True)
class FreeParameter:
    """One number that a fit may move.

    Parameters
    ----------
    key : str
        Parameter of the simulator.
    joint, log : int or None
        Where it counts, the log by its run; None for everywhere.
    size : float
        A change that has a visible effect.
    lower, upper : float
        Bounds.
    centre, tolerance : float or None
        What the datasheet says, or None.
    phase : bool
        It moves a phase, so that its size is the only step at which a difference is a slope.
    is_scale : bool
        It is known by its order of magnitude: a step changes it by a factor.
    axis : int or None
        Which component of a vector per joint it is; None of a number.

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
    is_scale: bool = False
    axis: int | None = None

    @property
    def of_robot(self) -> bool:
        """Whether it is one of the joint model or of the links, and of no cause."""
        return self.key in (*_JOINT_MODEL, LINK_MASS, LINK_COM)

    def place(self, k: int | slice = slice(None)) -> tuple[int | slice, ...]:
        """Index in the array of its key, at joint k or at all joints where it has none itself."""
        joint = k if self.joint is None else self.joint
        return tuple(part for part in (self.log, joint, self.axis) if part is not None)

    def violation(self, value: float, softness: float) -> float:
        """How far a value lies beyond its tolerance [standard deviations]."""
        if self.tolerance is None or self.centre is None:
            return 0.0
        z = (value - self.centre) / self.tolerance
        return np.sign(z) * max(abs(z) - 1.0, 0.0) / softness


@dataclasses.dataclass(frozen=True, eq=False)
class Hypothesis:
    """Joint model plus members, with values for all parameters.

    Parameters
    ----------
    problem : Problem
        The robot.
    members : tuple of Member
        The causes; none of them is the nominal model.
    values : dict
        Parameter of the simulator -> array (n,), or (runs, n) where it differs between logs.

    """

    problem: Problem
    members: tuple[Member, ...]
    values: Values

    @functools.cached_property
    def simulator(self) -> LoopRunner:
        """The closed loop of this hypothesis."""
        return simulator_of(self.problem, tuple(member.cause for member in self.all_members))

    @property
    def all_members(self) -> tuple[Member, ...]:
        """Causes of the hypothesis, behind those that the nominal model holds."""
        return (*held_members(self.problem), *self.members)

    @functools.cached_property
    def coupled(self) -> bool:
        """Whether links push each other in a loop that holds them.

        Of links that nothing holds, which fall as they like, a slope says little anyway.
        """
        problem, links = self.problem, self.problem.links
        pushed = links.has_coupling or links.has_gravity or any(
            piece.port == "body" for member in self.all_members for piece in member.cause.pieces)
        return problem.n > 1 and pushed and bool(np.all(problem.law.kp > 0))

    @functools.cached_property
    def is_weakly_coupled(self) -> bool:
        """Whether slopes of a spatial arm joint by joint lead downhill, for a sixth of the runs.

        A fit ends a little early on them, so that they serve to compare causes; the joint model
        alone, from which all of them start, needs the whole slopes.
        """
        problem = self.problem
        return (bool(self.members) and problem.links.known and not problem.links.is_planar
                and problem.mass_coupling < _WEAK_COUPLING)

    def spreads(self, parameter: FreeParameter) -> bool:
        """Whether a parameter of one joint changes the residual of others so that slopes need it.

        Links and their numbers act on all joints that carry them.
        """
        return (self.coupled and not self.is_weakly_coupled
                or parameter.key in self._keys_of_links)

    @functools.cached_property
    def _keys_of_links(self) -> frozenset[str]:
        """Parameters of links and of causes that act through them."""
        return frozenset((LINK_MASS, LINK_COM, *(
            f"{member.name}.{number.name}" for member in self.all_members
            for number in member.cause.numbers
            if any(piece.port == "body" for piece in member.cause.pieces))))

    def of_log(self, j: int, values: Values | None = None) -> Values:
        """Parameters of log j."""
        run = self.problem.runs[j]
        return {key: value[run] if value.ndim == 2 and key not in _MATRICES else value
                for key, value in (self.values if values is None else values).items()}

    def positions(self, j: int, sets: Sequence[Values]) -> np.ndarray:
        """Positions in log j for many sets of values, shape (sets, n, N) [rad]."""
        return self.simulator.positions(self.problem.logs[j],
                                        [self.of_log(j, values) for values in sets])

    def means(self, j: int, sets: Sequence[Values]) -> np.ndarray:
        """Positions in log j, decimated, for many sets of values [rad]."""
        return self.means_of_views([j], sets)[0]

    def means_of_views(self, views: Sequence[int], sets: Sequence[Values]) -> list[np.ndarray]:
        """The same in each of some logs that are views of one run."""
        logs = [self.problem.logs[j] for j in views]
        values = [self.of_log(views[0], one) for one in sets]
        return self.simulator.means(logs, values, rows_of(logs[0], self.problem.period).width)

    def error(self, j: int, dithered: bool = True) -> np.ndarray:
        """Measured less simulated position in log j, shape (N, n) [rad].

        The other encoder of a joint has a zero of its own, so that a level says nothing there.
        """
        log = self.problem.logs[j]
        q, = self.simulator.positions(log, [self.of_log(j)], dithered)
        error = log.bridged(np.nan_to_num(np.clip(log.q - q.T, -DIVERGED, DIVERGED), nan=DIVERGED))
        return error - error.mean(axis=0) if log.of_other_encoder else error

    @property
    def seen_by_law(self) -> "Hypothesis":
        """The same hypothesis on the logs of the law's encoder alone."""
        problem = views_of_law(self.problem)
        return self if problem is self.problem else dataclasses.replace(self, problem=problem)

    def with_values(self, values: Values) -> "Hypothesis":
        """Return the same hypothesis with other values."""
        return dataclasses.replace(self, values=values)

    @functools.cached_property
    def free_parameters(self) -> tuple[FreeParameter, ...]:
        """What a fit moves: the joint model, effects that the model holds, and the causes."""
        held = (_with_tolerance(parameter, member) for member in held_members(self.problem)
                for parameter in self._of_member(member))
        own = (parameter for member in self.members for parameter in self._of_member(member))
        return (*self._of_joint_model(), *self._of_links(), *held, *own)

    def _of_joint_model(self) -> Iterator[FreeParameter]:
        stated = self.problem.nominal
        freed = {(name, k) for member in self.members for name in member.cause.frees
                 for k in member.joints}
        for name in _JOINT_MODEL:
            centre, tolerance = getattr(stated, name), getattr(stated, f"{name}_tolerance")
            for k in range(self.problem.n):
                lower = {"inertia": _LEAST_INERTIA * centre[k], "damping": 0.0}.get(name, -np.inf)
                size = max(0.02 * abs(centre[k]), 0.3 * tolerance[k])
                yield FreeParameter(name, k, None, size, lower, np.inf, centre[k],
                                    None if (name, k) in freed else tolerance[k])

    def _of_links(self) -> Iterator[FreeParameter]:
        """Masses and centres of mass that are known with a tolerance, where the model feels them.

        A component of a centre of mass that is zero stays so.
        """
        links, nominal = self.problem.links, self.problem.nominal
        if not (nominal.mass_tolerance or nominal.com_tolerance) or not (
                links.has_gravity or links.has_coupling):
            return
        for k in np.flatnonzero(links.mass if nominal.mass_tolerance else ()):
            mass, tolerance = links.mass[k], nominal.mass_tolerance * links.mass[k]
            yield FreeParameter(LINK_MASS, int(k), None, 0.3 * tolerance, _LEAST_MASS * mass,
                                np.inf, mass, tolerance)
        massive = links.com * (links.mass > 0.0)[:, None]
        for k, axis in np.argwhere(massive if nominal.com_tolerance else np.zeros((0, 0))):
            yield FreeParameter(LINK_COM, int(k), None, 0.3 * nominal.com_tolerance, -np.inf,
                                np.inf, links.com[k, axis], nominal.com_tolerance, axis=int(axis))

    def _of_member(self, member: Member) -> Iterator[FreeParameter]:
        for number in member.cause.numbers:
            if number.fixed:
                continue
            key = f"{member.name}.{number.name}"
            size = np.max(np.abs(np.atleast_2d(member.sizes[number.name])), axis=0)
            if number.scope == "robot":
                yield FreeParameter(key, None, None, size[member.joints[0]],
                                    number.lower, number.upper)
                continue
            runs = range(self.problem.fit_runs) if number.scope == "log" else (None,)
            for log in runs:
                for k in member.joints:
                    yield FreeParameter(key, k, log, size[k], number.lower,
                                        self._upper(number, k), phase=number.phase,
                                        is_scale=number.is_scale)

    def _upper(self, number: Number, k: int) -> float:
        """Largest value of a number of a cause at joint k."""
        if number.most_torque is None:
            return number.upper
        return min(number.upper, number.most_torque * float(self.problem.rms_command[k]))

    def get(self, parameter: FreeParameter) -> float:
        """Value of a free parameter."""
        k = parameter.joint
        if k is None:
            k = next(member.joints[0] for member in self.all_members
                     if parameter.key.startswith(f"{member.name}."))
        return float(self.values[parameter.key][parameter.place(k)])

    def moved(self, steps: Iterable[tuple[FreeParameter, float]]) -> Values:
        """Return the values with new ones for some free parameters.

        A link that is heavier has a larger inertia about its centre of mass in the same ratio.
        """
        values = dict(self.values)
        for parameter, value in steps:
            array, place = values[parameter.key].copy(), parameter.place()
            if parameter.key == LINK_MASS:
                inertia = values[_LINK_INERTIA].copy()
                inertia[place] *= value / array[place]
                values[_LINK_INERTIA] = inertia
            array[place] = value
            values[parameter.key] = array
        return values

    def prior_violations(self, softness: float) -> np.ndarray:
        """Distances beyond the datasheet, one per free parameter [standard deviations]."""
        return np.array([parameter.violation(self.get(parameter), softness)
                         for parameter in self.free_parameters])


def _with_tolerance(parameter: FreeParameter, member: Member) -> FreeParameter:
    """Parameter of an effect that the nominal model holds: it may move within its size."""
    value = member.values[parameter.key.removeprefix(f"{member.name}.")]
    centre = float(value[parameter.place(member.joints[0])])
    return dataclasses.replace(parameter, centre=centre, tolerance=parameter.size)


def build_hypothesis(problem: Problem, members: Iterable[Member],
                     joint_model: Hypothesis | None = None) -> Hypothesis:
    """Return the hypothesis of some members, with the joint model stated or as it was fitted."""
    members = tuple(members)
    values = constants(problem)
    for member in (*held_members(problem), *members):
        for number in member.cause.numbers:
            value = np.array(member.values[number.name], float)
            if number.scope != "robot" and number.neutral is not None:
                idle = [k for k in range(problem.n) if k not in member.joints]
                value[..., idle] = number.neutral
            values[f"{member.name}.{number.name}"] = value
    if joint_model is not None:
        held = {f"{member.name}.{number.name}" for member in held_members(problem)
                for number in member.cause.numbers}
        values.update({key: value for key, value in joint_model.values.items()
                       if key in held
                       or key in (*_JOINT_MODEL, LINK_MASS, LINK_COM, _LINK_INERTIA, "a", "b")})
    return Hypothesis(problem, members, values)


def residuals_of_sets(hypothesis: Hypothesis, sets: Sequence[Values], residuals: ResidualModel,
                      logs: Sequence[int] | None = None) -> list[list[np.ndarray]]:
    """Residuals of each joint, one row per set of values, log by log; by default of the fit logs.

    The runs are simulated side by side, each once for all its views.
    """
    problem = hypothesis.problem
    logs = range(len(problem.fit)) if logs is None else logs
    views = [list(of_run) for _, of_run in itertools.groupby(logs, key=problem.runs.__getitem__)]

    def residuals_of_run(of_run: list[int]) -> list[list[np.ndarray]]:
        means = hypothesis.means_of_views(of_run, sets)
        return [residuals.of_runs(of_view, j) for j, of_view in zip(of_run, means)]

    return [of_log for of_run in side_by_side(residuals_of_run, views,
                                              hypothesis.simulator.threads) for of_log in of_run]


def chi2_by_joint(variants: Sequence[Hypothesis], residuals: ResidualModel, j: int,
                  ) -> list[np.ndarray]:
    """chi^2 of each joint in log j, one value per variant: they are simulated side by side.

    The variants are one hypothesis with several values.
    """
    (parts,) = residuals_of_sets(variants[0], [one.values for one in variants], residuals, (j,))
    return [(part**2).sum(axis=1) for part in parts]


def costs(variants: Sequence[Hypothesis], residuals: ResidualModel) -> np.ndarray:
    """Cost on the fit logs of each of some variants of a hypothesis, simulated side by side."""
    softness = residuals.method.fitting.prior_softness
    violations = [variant.prior_violations(softness) for variant in variants]
    of_priors = np.array([violation @ violation for violation in violations])
    parts = residuals_of_sets(variants[0], [one.values for one in variants], residuals)
    return of_priors + sum((part**2).sum(axis=1) for of_log in parts for part in of_log)
