"""Models with their BIC as an answer: probabilities, joints, and the gap on unseen data."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.prediction_error import gap
from clie_blocks.analysis.gap.problem.problem import Problem

PARAMETRIC_FROM = 2.0  # tolerances of the datasheet beyond which a parameter is wrong


@dataclasses.dataclass(frozen=True, eq=False)
class Model:
    """One fitted model.

    Parameters
    ----------
    members : tuple of Member
        Its causes; none of them is the nominal model.
    bic : float
        Bayesian information criterion.
    values : dict
        Parameters of the joint model, and of the causes where they were fitted.

    """

    members: tuple[Member, ...]
    bic: float
    values: dict[str, np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        """Its causes, sorted."""
        return tuple(sorted({member.cause.name for member in self.members}))


def bic(squares: float, samples: int, parameters: int) -> float:
    """Bayesian information criterion of a least-squares fit.

    Parameters
    ----------
    squares : float
        Sum of squared residuals.
    samples, parameters : int
        Independent samples, and parameters fitted.

    """
    return samples * np.log(max(squares, 1e-300) / samples) + parameters * np.log(samples)


def answer(problem: Problem, models: Sequence[Model]) -> dict[str, Any]:
    """Return the answer of the nominal and other models in the form of ``clie diagnose``."""
    scores = np.array([model.bic for model in models])
    weights = np.exp(-(scores - scores.min()) / 2)
    weights /= weights.sum()
    order = np.argsort(-weights)
    no_cause = "parametric" if _is_parametric(problem, models) else "none"
    probability: dict[str, float] = {}
    joints: dict[str, list[int] | None] = {}
    covered: list[str] = []
    total = 0.0
    for i in order:
        for name in models[i].names or (no_cause,):
            probability[name] = probability.get(name, 0.0) + float(weights[i])
            joints.setdefault(name, _joints(models[i], name))
            if total < 0.9 and name not in covered:
                covered.append(name)
        total += weights[i]
    probability.setdefault(no_cause, 0.0)
    nominal = next(model for model in models if not model.members)
    return {"effects": [{"effect": name, "joint": joints.get(name), "probability": share}
                        for name, share in probability.items()],
            "set_90": covered, "unexplained": False,
            "gap_before": prediction_gap(problem, nominal),
            "gap_after": prediction_gap(problem, models[order[0]])}


def prediction_gap(problem: Problem, model: Model) -> float:
    """Gap of a model on the unseen logs [rad], see `prediction_error.gap`."""
    hypothesis = build_hypothesis(problem, model.members)
    return gap(hypothesis.with_values({**hypothesis.values, **model.values}))


def _is_parametric(problem: Problem, models: Sequence[Model]) -> bool:
    """Whether the nominal model's fitted parameters lie beyond the datasheet."""
    values, nominal = next(m.values for m in models if not m.members), problem.nominal
    return any(np.any(np.abs(values[name] - getattr(nominal, name))
                      > PARAMETRIC_FROM * getattr(nominal, f"{name}_tolerance"))
               for name in ("inertia", "damping", "load"))


def _joints(model: Model, name: str) -> list[int] | None:
    return next(([k + 1 for k in member.joints] for member in model.members
                 if member.cause.name == name), None)
