"""The diagnosis with one of its stages removed, to see what that stage contributes.

Stages are values and thresholds are fields, so an ablation is a diagnosis with another `Stages` or
another `Method`.  Nothing else changes: same logs, same library, same verdict.
"""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import Noise, decimation, sensor_noise_model
from clie_blocks.analysis.gap.residual.whitening import NoiseModel
from clie_blocks.analysis.gap.stages import STAGES, Stages

CORNER = 8.0  # Hz of the parallel filter of textbook identification
TAPS = 41

# no score reads the advice on the next experiment
SCORED = dataclasses.replace(STAGES, next_experiment=lambda *_: None)
UNPOLISHED = dataclasses.replace(SCORED, refine_to_prior=lambda fit, residuals: fit,
                                 explain_backlash=lambda *_: None)
NO_STEPS = METHOD.with_values(**{
    "search.first_steps": 0, "search.finalist_steps": 0, "search.leader_steps": 0,
    "search.event_rounds": 0})


def diagnose_with(problem: Problem, method: Method = METHOD, stages: Stages = SCORED,
                  exclude: Sequence[str] = ()) -> dict[str, Any]:
    """Answer of the diagnosis with other thresholds, other stages, or effects left out."""
    with np.errstate(over="ignore"):  # the torque map undoes whitening, if there is any
        found = diagnose(problem, method, exclude=exclude, stages=stages)
        return found.to_dict()


def with_noise_model(noise_model: NoiseModel) -> Stages:
    """Stages with another model of the noise, and with it another whitening."""
    return dataclasses.replace(SCORED, steps=dataclasses.replace(
        SCORED.steps, noise_model=noise_model))


def noise_without_whitening(problem: Problem, k: int, responses: Sequence[np.ndarray]) -> Noise:
    """Noise of joint k with errors weighed by their size alone, whatever their frequency."""
    noise = sensor_noise_model(problem, k, responses)
    return _with_whitener(noise, problem, np.ones(1), responses[k])


def noise_without_sensitivity(problem: Problem, k: int, responses: Sequence[np.ndarray]) -> Noise:
    """Noise of joint k with errors turned back into torques and low-passed: no sensitivity.

    The error of the closed loop is S times the error of the equation of motion.  Its inverse,
    inertia ddq + damping dq + kp q + kd dq, gives the torque that is missing in that equation,
    which is what regression without the sensitivity filter looks at.
    """
    from scipy.signal import firwin

    h = decimation(problem.period) * problem.period
    nominal, law = problem.nominal, problem.law
    torque = (nominal.inertia[k] * np.array([1.0, -2.0, 1.0]) / h**2
              + (nominal.damping[k] + law.kd[k]) * np.array([1.0, 0.0, -1.0]) / (2 * h)
              + law.kp[k] * np.array([0.0, 1.0, 0.0]))
    low_pass = firwin(TAPS, min(CORNER, 0.4 / h), fs=1.0 / h)
    noise = sensor_noise_model(problem, k, responses)
    return _with_whitener(noise, problem, np.convolve(torque, low_pass), responses[k])


def _with_whitener(noise: Noise, problem: Problem, shape: np.ndarray,
                   response: np.ndarray) -> Noise:
    """The same noise with a filter instead of the whitening one, scaled to variance one."""
    width = decimation(problem.period)
    averaged = np.convolve(noise.sigma * response, np.full(width, 1.0 / width))
    upsampled = np.zeros((len(shape) - 1) * width + 1)
    upsampled[::width] = shape
    return dataclasses.replace(
        noise, whitener=shape / np.sqrt(np.sum(np.convolve(averaged, upsampled) ** 2)))


def without_priors(problem: Problem) -> Problem:
    """The problem of a robot whose datasheet states no tolerance."""
    if problem.statement is None:
        raise ValueError("only a problem stated from a robot and its logs has a datasheet")
    robot, records, held_out = problem.statement
    motor = dataclasses.replace(robot.motor, inertia_tolerance=None,
                                viscous_friction_tolerance=None, torque_offset_tolerance=None)
    return Problem.from_logs(dataclasses.replace(robot, motor=motor), records, held_out)


def _with_noise(noise_model: NoiseModel) -> Callable[[Problem], dict[str, Any]]:
    return functools.partial(diagnose_with, stages=with_noise_model(noise_model))


ABLATIONS: dict[str, Callable[[Problem], dict[str, Any]]] = {
    "no sensitivity filter": _with_noise(noise_without_sensitivity),
    "no whitening": _with_noise(noise_without_whitening),
    "no polish": functools.partial(diagnose_with, method=NO_STEPS, stages=UNPOLISHED),
    "no priors": lambda problem: diagnose_with(without_priors(problem)),
}
