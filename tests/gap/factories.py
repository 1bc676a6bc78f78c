"""Small real objects for tests, with plain defaults: logs, problems, fits, evidence."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.nominal import Nominal
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import Noise
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause
from clie_blocks.robot_loop.links import no_links

PERIOD = 0.01  # s
SAMPLES = 1000.0  # whitened ones of each log and joint of a fit


def make_log(q: np.ndarray, u: np.ndarray | None = None, name: str = "log") -> Log:
    """Log of a motion (N, n) [rad], at rest at its start; the command is the motion by default."""
    zero = np.zeros_like(q)
    return Log(name, q, q if u is None else u, q, zero, q[0], True, zero)


def make_law(n: int = 1, period: float = PERIOD, kp: float = 40.0, kd: float = 8.0) -> StatedLaw:
    """Law with the velocity as a difference of positions."""
    one, zero = np.ones(n), np.zeros(n)
    return StatedLaw(kp * one, kd * one, np.array([one, -one, zero]) / period,
                     np.array([one, zero, zero]), period, zero, np.full(n, np.inf))


def make_problem(courses: Sequence[np.ndarray] | None = None, n: int = 1, held_out: int = 1,
                 gear_ratio: float = 1.0, resolution: float = 0.0, known_links: bool = False,
                 inside: Sequence[Member] = (), period: float = PERIOD) -> Problem:
    """Problem of motions (N, n) [rad], of which the last ones are held out; a ramp by default."""
    if courses is None:
        courses = [np.linspace(0.0, 0.5, 50)[:, None] * np.ones(n)] * 3
    logs = [make_log(q, name=f"log-{j + 1}") for j, q in enumerate(courses)]
    n = courses[0].shape[1]
    one, zero = np.ones(n), np.zeros(n)
    nominal = Nominal(0.5 * one, 0.5 * one, zero, 0.005 * one, 0.1 * one, 0.4 * one)
    links = dataclasses.replace(no_links(n), known=known_links)
    fitted = len(logs) - held_out
    return Problem(tuple(logs[:fitted]), tuple(logs[fitted:]), make_law(n, period), nominal, links,
                   gear_ratio * one, one, resolution * one,
                   tuple(f"joint {k + 1}" for k in range(n)), tuple(inside))


def make_member(cause: Cause, problem: Problem, joints: Sequence[int] | None = None,
                sizes: Mapping[str, float] | None = None, **values: object) -> Member:
    """Cause at all joints, or at some, with parameters of one, but for those that are stated."""
    n, logs = problem.n, len(problem.law_logs)
    shapes = {number.name: (logs, n) if number.scope == "log" else (n,)
              for number in cause.numbers}
    stated = {name: np.array(np.broadcast_to(values.get(name, 1.0), shape), float)
              for name, shape in shapes.items()}
    steps = {name: np.full(n, float((sizes or {}).get(name, 1.0))) for name in shapes}
    return Member(cause, tuple(range(n) if joints is None else joints), stated, steps)


def make_fit(problem: Problem, *members: Member, excess: float = 0.1,
             spread: float | Sequence[float] = 1.0, prior_violation: Sequence[float] = (),
             iterations: int = 1) -> Fit:
    """Fit of some causes with their values as they are, which leaves an excess.

    `spread` is the standard deviation of the free parameters of the causes, in their sizes.
    """
    hypothesis = build_hypothesis(problem, members)
    free = hypothesis.free_parameters
    violation = np.zeros(len(free))
    violation[:len(prior_violation)] = prior_violation
    samples = np.full((len(problem.logs), problem.n), SAMPLES)
    priced = sum(parameter.tolerance is None for parameter in free) * np.log(samples.sum())
    chi2 = samples.sum() * (1.0 + excess / problem.n) - priced - violation @ violation
    causes = len(free) - 3 * problem.n  # behind inertia, damping and load of each joint
    size = np.array([parameter.size for parameter in free])
    deviation = np.concatenate([np.ones(3 * problem.n), np.broadcast_to(spread, causes)]) * size
    return Fit(hypothesis, chi2 * samples / samples.sum(), samples, violation,
               np.diag(deviation**2), deviation, iterations)


def moved(fit: Fit, **values: np.ndarray) -> Fit:
    """Fit with other values of some parameters, whose keys are written with ``__`` for a dot."""
    changed = {key.replace("__", "."): np.asarray(value, float) for key, value in values.items()}
    hypothesis = fit.hypothesis.with_values({**fit.hypothesis.values, **changed})
    return dataclasses.replace(fit, hypothesis=hypothesis)


@dataclasses.dataclass(frozen=True, eq=False)
class Missing(Hypothesis):
    """Hypothesis whose prediction error is stated rather than simulated."""

    missed: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))

    def error(self, j: int, dithered: bool = True) -> np.ndarray:
        """The stated error, whatever the log."""
        return self.missed


def make_residual_model(problem: Problem, sigma: float = 1e-4, method: Method = METHOD,
                        whitener: np.ndarray | None = None) -> ResidualModel:
    """Residual model with noise of one size, which is white by default; no initial response."""
    white = np.array([1.0 / sigma]) if whitener is None else whitener
    noise = Noise(sigma, sigma, white)
    return ResidualModel(problem, (noise,) * problem.n,
                         [[np.zeros((len(log), 0))] * problem.n for log in problem.logs], method)


def make_check(n: int = 1, step: float = 0.0, wrong: Sequence[int] = (),
               coarse: Sequence[int] = ()) -> ControllerCheck:
    """Check of the controller that found joints with another filter, or with a coarse encoder."""
    corners = np.array([np.full(n, 200.0), np.full(n, 300.0)])
    return ControllerCheck(np.zeros(n), np.ones(n), tuple(wrong), corners, tuple(coarse),
                           np.full(n, step), make_law(n), ())


def make_row(names: str, excess: float = 0.1, parameter_count: float = 1.0,
             prior_violations: int = 0, confounder: str = "", fit: Fit | None = None,
             prior_violation: float = 0.0, imitated: Sequence[str] = ()) -> Row:
    """Evidence on some causes, written ``coulomb+spring``."""
    return Row(tuple(names.split("+")), excess, parameter_count, prior_violations, confounder,
               prior_violation, tuple(imitated), fit)


def make_table(nominal_excess: float, *rows: Row, prior_violation: float = 0.0,
               prior_violations: int = 0, free: Sequence[float] = ()) -> Table:
    """Evidence on one robot."""
    return Table(nominal_excess, prior_violation, prior_violations, tuple(free), list(rows))


def make_ranked(names: str, probability: float = 1.0, excess: float = 0.0,
                fit: Fit | None = None) -> RankedCause:
    """Entry of a ranking, its causes written ``coulomb+spring``."""
    return RankedCause(tuple(names.split("+")), fit, excess, probability)
