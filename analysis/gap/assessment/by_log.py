"""Parameters of the corrected model, found from each log alone: what a repetition changes."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from clie_blocks.analysis.gap.assessment.gap_reduction import MaskedResidual
from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import FreeParameter, Hypothesis
from clie_blocks.analysis.gap.fitting.law_view import law_view
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

JOINT_MODEL = "joint model"  # owner of what belongs to no cause
_UNITS = {"inertia": "kg m^2", "damping": "N m s/rad", "load": "N m"}


@dataclasses.dataclass(frozen=True, eq=False)
class ParameterByLog:
    """One parameter of the corrected model.

    Parameters
    ----------
    effect : str
        The effect that it belongs to, or `JOINT_MODEL`.
    joint : int or None
        The joint, from 0; None of the whole robot.
    name, unit : str
        Of the parameter.
    value, deviation : ndarray, shape (logs,)
        From each log alone, and the standard deviations of the fits.

    """

    effect: str
    joint: int | None
    name: str
    unit: str
    value: np.ndarray
    deviation: np.ndarray


def parameters_by_log(result: Result) -> tuple[ParameterByLog, ...]:
    """Fit the corrected model to each log alone; what differs between logs by itself is left out.

    Each fit begins with what all logs gave, and has the same datasheet as prior.
    """
    seen = law_view(result.model, result.residuals)
    problem = dataclasses.replace(seen.residuals.problem, fit=seen.residuals.problem.logs,
                                  held_out=())
    start = dataclasses.replace(seen.fit.hypothesis, problem=problem)
    fits = [fit(start, _of_one_log(seen.residuals, start, j),
                result.method.assessment.refit_steps) for j in range(len(problem.logs))]
    return tuple(_rows(start, fits))


def _of_one_log(residuals: ResidualModel, model: Hypothesis, kept: int) -> ResidualModel:
    """Residual model for which the other logs do not count."""
    seen = [np.full(len(responses[0]), j == kept)
            for j, responses in enumerate(residuals.initial_responses)]
    return MaskedResidual(model.problem, residuals.noises, residuals.initial_responses,
                          residuals.method, residuals.counted, residuals.other_noises, seen=seen)


def _rows(model: Hypothesis, fits: list[Fit]) -> Iterator[ParameterByLog]:
    for i, parameter in enumerate(model.free_parameters):
        owner = _owner(model, parameter)
        if parameter.log is not None or owner is None:
            continue
        effect, name, unit = owner
        yield ParameterByLog(
            effect, parameter.joint, name, unit,
            np.array([one.hypothesis.get(parameter) for one in fits]),
            np.array([one.spread[i] for one in fits]))


def _owner(model: Hypothesis, parameter: FreeParameter) -> tuple[str, str, str] | None:
    """Effect, name and unit of a parameter; None of the links and of what the model holds."""
    if parameter.key in _UNITS:
        return JOINT_MODEL, parameter.key, _UNITS[parameter.key]
    block, _, name = parameter.key.partition(".")
    for member in model.members:
        for number in member.cause.numbers:
            if member.name == block and number.name == name and not number.nuisance:
                return member.cause.name, name, number.unit
    return None
