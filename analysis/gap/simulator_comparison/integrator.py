"""The error of a simulator's integrator, which is no difference between robot and simulator.

In a step of length h a torque that is held from its sample on moves a joint by h^2 u / (2 J).
Semi-implicit and implicit Euler move it by twice that, explicit Euler not at all: to first order
in h their positions lead the motion by half a step, or lag it by half a step.  So the model of a
simulator may shift its positions by so much in time, which is never counted as a difference.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.robot_loop.dynamics import Piece, State

LARGEST_LEAD = 1.0  # periods
REPORTED_LEAD = 0.1  # periods, below which a lead is not reported


def _ahead(s: State, z: Sequence[np.ndarray], p: Mapping[str, np.ndarray],
           ) -> tuple[np.ndarray, list[np.ndarray]]:
    """Position a little ahead, on the parabola through the last three."""
    previous, before = z
    ahead = p["lead"] / s.h * (1.5 * s.q - 2.0 * previous + 0.5 * before)
    return s.q + ahead, [s.q, previous]


LEAD = Cause("integrator_lead", (Piece("sensor", _ahead, states=2),),
             (Number("lead", "s", scope="robot"),), lambda scene: [])


def with_integrator(problem: Problem, largest: float = LARGEST_LEAD) -> Problem:
    """Problem of a simulator whose positions may lead or lag the motion by some periods."""
    bounded = dataclasses.replace(LEAD, numbers=(dataclasses.replace(
        LEAD.numbers[0], lower=-largest * problem.period, upper=largest * problem.period),))
    zero = np.zeros(problem.n)
    lead = Member(bounded, tuple(range(problem.n)), {"lead": zero},
                  {"lead": zero + problem.period / 2})
    return dataclasses.replace(problem, inside=(*problem.inside, lead))


def lead_of(model: Hypothesis) -> float:
    """Time by which a simulator's integrator runs ahead [s]."""
    return float(model.values[f"{LEAD.name}.lead"][0])


def describe_integrator(model: Hypothesis) -> tuple[str, ...]:
    """Sentence on the integrator; nothing where its lead is negligible."""
    lead, period = lead_of(model), model.problem.period
    if abs(lead) < REPORTED_LEAD * period:
        return ()
    return (f"the simulator's positions are {1e3 * abs(lead):.2g} ms "
            f"{'ahead' if lead > 0 else 'behind'}, {abs(lead) / period:.2f} of a period, as the "
            "long steps of Euler's method make them: this is an error of its integrator and is "
            "not counted as a difference; shorter steps remove it",)
