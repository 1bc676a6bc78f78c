"""What the integrator of a user's simulator does to its motion, which is no physics of a robot.

In a step of length h a torque that is held from its sample on moves a joint by h^2 u / (2 J).
Semi-implicit and implicit Euler move it by twice that, explicit Euler not at all: to first order
in h their positions are half a step ahead of the motion, or half a step behind.  So the model of a
simulator may read its positions early or late by so much, which is never counted as a difference.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation.dynamics import Piece

MOST = 1.0  # periods
TOLD = 0.1  # periods, from which on the reader hears of it


def _ahead(q: np.ndarray, z: Sequence[np.ndarray], p: Mapping[str, np.ndarray], h: float,
           ) -> tuple[np.ndarray, list[np.ndarray]]:
    """Position a little ahead, on the parabola through the last three."""
    last, before = z
    return q + p["lead"] / h * (1.5 * q - 2.0 * last + 0.5 * before), [q, last]


LEAD = Cause("integrator_lead", (Piece("sensor", _ahead, states=2),),
             (Number("lead", "s", scope="robot"),), lambda scene: [])


def with_integrator(problem: Problem) -> Problem:
    """Problem of a simulator whose positions may be half a period early or late."""
    bounded = dataclasses.replace(LEAD, numbers=(dataclasses.replace(
        LEAD.numbers[0], lower=-MOST * problem.period, upper=MOST * problem.period),))
    zero = np.zeros(problem.n)
    lead = Member(bounded, tuple(range(problem.n)), {"lead": zero},
                  {"lead": zero + problem.period / 2})
    return dataclasses.replace(problem, inside=(*problem.inside, lead))


def lead_of(model: Hypothesis) -> float:
    """Time by which a simulator's integrator runs ahead [s]."""
    return float(model.values[f"{LEAD.name}.lead"][0])


def describe_integrator(model: Hypothesis) -> tuple[str, ...]:
    """Sentence on the integrator; nothing where it hardly matters."""
    lead, period = lead_of(model), model.problem.period
    if abs(lead) < TOLD * period:
        return ()
    return (f"the simulator's positions are {1e3 * abs(lead):.2g} ms "
            f"{'ahead' if lead > 0 else 'behind'}, {abs(lead) / period:.2f} of a period, as long "
            "steps of Euler's method make them: that is its integrator and not counted as a "
            "difference; shorter steps remove it",)
