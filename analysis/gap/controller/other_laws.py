"""The law that ran at joints whose commands are not those of the stated one."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples, law_residual
from clie_blocks.analysis.gap.controller.named import ALIKE, Found, NamedJoint, explanations
from clie_blocks.analysis.gap.controller.refit import (
    describe_gains,
    describe_integral,
    with_gain_error,
)
from clie_blocks.analysis.gap.controller.replayed_joint import joint_of
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.linear_filters import lfilter

# The first samples of a cut log, and those behind a loss, are left out of the fit of its filter:
# its state is unknown there, for so many times the settling of the stated one if it is slower.
SLOWEST_FILTER = 4
FILTER, LAG = "velocity_filter_mismatch", "velocity_estimate_lag"


def replay_error(problem: Problem, law: StatedLaw) -> np.ndarray:
    """Largest RMS of the residual of all logs [N m], shape (n,)."""
    squares = [np.mean(law_residual(law, log) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


@dataclasses.dataclass(eq=False)
class OtherLaws:
    """What ran at joints whose commands are not those of the stated law.

    Parameters
    ----------
    law : StatedLaw
        The law with the gains and the filters that ran.
    corners : ndarray, shape (2, n)
        High-pass and low-pass corner [rad/s]; NaN where none is stated.
    integral : ndarray, shape (n,)
        Integral gains that ran [N m/(rad s)].
    decisions : list of str
        What was decided, one sentence each.
    other_filter, other_gains, unexplained : list of int
        Joints with another velocity filter, with other gains, and those of no known law.
    named : list of NamedJoint
        Joints with an effect of the catalogue.

    """

    law: StatedLaw
    corners: np.ndarray
    integral: np.ndarray
    decisions: list[str]
    other_filter: list[int] = dataclasses.field(default_factory=list)
    other_gains: list[int] = dataclasses.field(default_factory=list)
    unexplained: list[int] = dataclasses.field(default_factory=list)
    named: list[NamedJoint] = dataclasses.field(default_factory=list)


def other_laws(problem: Problem, stated: StatedLaw, limit: np.ndarray, joints: Sequence[int],
               ) -> OtherLaws:
    """Laws that ran at some joints, as far as effects of the catalogue explain their commands."""
    corners = (np.nan, np.nan) if stated.corners is None else stated.corners
    laws = OtherLaws(stated, np.outer(corners, np.ones(problem.n)), np.zeros(problem.n), [])
    for k in joints:
        found = explanations(joint_of(problem, stated, k, float(limit[k])))
        filtered = _other_filter(problem, stated, k, float(limit[k]), found)
        if filtered is not None and _is_better(*filtered, found):
            _add_filter(laws, k, filtered[0], problem.joints[k])
        elif found:
            is_lag = stated.corners is None and found[0].name == LAG
            also = is_lag or (filtered is not None and filtered[1] <= ALIKE * found[0].left)
            _add_named(laws, NamedJoint(k, tuple(found), (FILTER,) if also else ()), stated,
                       problem.joints[k])
        else:
            laws.unexplained.append(k)
    return laws


def describe_filter(name: str, high: float, low: float) -> str:
    """Corners of the filter that ran at a joint [rad/s], as a sentence."""
    return (f"{name}: the velocity filter that ran has corners {high:.0f} and {low:.0f} rad/s, "
            "not the stated ones")


def _add_filter(laws: OtherLaws, k: int, corners: tuple[float, float], name: str) -> None:
    laws.law = laws.law.with_filter(slice(k, k + 1), laws.law.variant, corners)
    laws.corners[:, k] = corners
    laws.other_filter.append(k)
    laws.decisions.append(describe_filter(name, *corners))


def _add_named(laws: OtherLaws, named: NamedJoint, stated: StatedLaw, name: str) -> None:
    k, best, values = named.joint, named.found[0], named.found[0].values
    laws.named.append(named)
    sentence = named.describe(name)
    if best.name == "gain_error":
        laws.law = with_gain_error(laws.law, k, **values)
        laws.other_gains.append(k)
        sentence = describe_gains(name, stated, laws.law, k)
    if best.name == "hidden_integral" and "clamp" not in values:
        laws.integral[k] = values["ki"]
        sentence = describe_integral(name, values["ki"])
    laws.decisions.append(sentence)


def _other_filter(problem: Problem, law: StatedLaw, k: int, limit: float, found: Sequence[Found],
                  ) -> tuple[tuple[float, float], float] | None:
    """Corners of the velocity filter that explain the commands of joint k, and what they leave.

    They are two parameters, looked for where no effect with one explains the commands, and beside
    a lag of the velocity, which is a corner by another name.
    """
    if law.corners is None or (found and found[0].name != LAG and len(found[0].values) == 1):
        return None
    corners = _fitted_corners(problem, law, law.corners, k)
    candidate = law.with_filter(slice(k, k + 1), law.variant, corners)
    left = float(replay_error(problem, candidate)[k])
    return (corners, left) if left <= limit else None


def _is_better(corners: tuple[float, float], left: float, found: Sequence[Found]) -> bool:
    """Whether two corners explain the commands with less than what was found, or leave less."""
    return (not found or len(found[0].values) > len(corners)
            or left < found[0].left / ALIKE)


def _fitted_corners(problem: Problem, law: StatedLaw, stated: tuple[float, float], k: int,
                    ) -> tuple[float, float]:
    """Corners of G1 whose replay is nearest to the logged commands of joint k."""
    from scipy.optimize import least_squares

    signals = [(log.q[:, k] - log.q[0, k],
                law.kp[k] * (log.q_d[:, k] - log.q[:, k]) + log.pe[:, k] - log.u[:, k],
                known_samples(log, law, SLOWEST_FILTER)) for log in problem.logs]

    def error(exponents: np.ndarray) -> np.ndarray:
        b, a = velocity_filter(law.variant, law.period, np.exp(exponents))
        return np.concatenate([(law.kd[k] * lfilter(b, a, moved) - damping_torque)[known]
                               for moved, damping_torque, known in signals])

    starts = np.log(np.array(stated)) + np.array([[0.0, 0.0], [-0.7, -0.7], [0.7, 0.7]])
    fits = [least_squares(error, start, x_scale=0.1, max_nfev=40) for start in starts]
    high_pass, low_pass = np.sort(np.exp(min(fits, key=lambda fit: fit.cost).x))
    return float(high_pass), float(low_pass)
