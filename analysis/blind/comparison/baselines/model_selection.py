"""Models with their BIC as an answer: probabilities, joints, and the gap on unseen data."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import hypothesis
from clie_blocks.analysis.gap.fitting.prediction_error import gap

PARAMETRIC_FROM = 2.0  # tolerances of the datasheet beyond which a number is wrong


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
        Numbers of the joint model, and of the causes where they were fitted.

    """

    members: tuple
    bic: float
    values: dict

    @property
    def names(self):
        """Its causes, sorted."""
        return tuple(sorted({member.cause.name for member in self.members}))


def bic(squares, samples, numbers):
    """Bayesian information criterion of a least-squares fit.

    Parameters
    ----------
    squares : float
        Sum of squared residuals.
    samples, numbers : int
        Independent samples, and numbers fitted.

    """
    return samples * np.log(max(squares, 1e-300) / samples) + numbers * np.log(samples)


def answer(problem, models):
    """Return the answer of some models in the form of ``clie diagnose``.

    Parameters
    ----------
    problem : Problem
        The robot.
    models : list of Model
        The nominal model and others.

    """
    scores = np.array([model.bic for model in models])
    weights = np.exp(-(scores - scores.min()) / 2)
    weights /= weights.sum()
    order = np.argsort(-weights)
    plain = "parametric" if _strayed(problem, models) else "none"
    probability, joints, covered, reached = {}, {}, [], 0.0
    for i in order:
        for name in models[i].names or (plain,):
            probability[name] = probability.get(name, 0.0) + float(weights[i])
            joints.setdefault(name, _joints(models[i], name))
            if reached < 0.9 and name not in covered:
                covered.append(name)
        reached += weights[i]
    probability.setdefault(plain, 0.0)
    nominal = next(model for model in models if not model.members)
    return {"effects": [{"effect": name, "joint": joints.get(name), "probability": share}
                        for name, share in probability.items()],
            "set_90": covered, "unexplained": False,
            "gap_before": predicted(problem, nominal),
            "gap_after": predicted(problem, models[order[0]])}


def predicted(problem, model):
    """Gap of a model on the unseen logs [rad], see `shrinkage.gap`."""
    at = hypothesis(problem, model.members)
    return gap(at.with_values({**at.values, **model.values}))


def _strayed(problem, models):
    """Whether the nominal model's fitted numbers lie beyond the datasheet."""
    values, nominal = next(m.values for m in models if not m.members), problem.nominal
    return any(np.any(np.abs(values[name] - getattr(nominal, name))
                      > PARAMETRIC_FROM * getattr(nominal, f"{name}_tolerance"))
               for name in ("inertia", "damping", "load"))


def _joints(model, name):
    return next(([k + 1 for k in member.joints] for member in model.members
                 if member.cause.name == name), None)
