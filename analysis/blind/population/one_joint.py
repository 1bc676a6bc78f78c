"""Trials of one joint with one link and one effect, of those that every simulator is given."""

import dataclasses

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.population.effects import STANDARD_NAMES
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.standard import draw_trial

NAMES = ("coulomb", "spring", "actuator_lag", "asymmetric_coulomb", "time_delay",
         "quadratic_drag", "actuator_saturation", "joint_elasticity", "stribeck", "presliding",
         "torque_ripple", "backlash", "load_dependent_friction", "friction_drift", "gravity",
         "payload", "dead_zone", "torque_gain_error", "encoder_quantization",
         "encoder_eccentricity", "periodic_disturbance", "step_fault")
SIZES = "medium", "strong"
PENDULUMS = dataclasses.replace(STANDARD_NAMES, needs={
    name: (("pendulum",), *needs[1:]) for name, needs in STANDARD_NAMES.needs.items()})


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    lap, place = divmod(index, len(NAMES))
    trial = draw_trial(rng, index, "single", (NAMES[place],), SIZES[(lap + place) % 2],
                       "pendulum", vocabulary=PENDULUMS)
    trial.label["gap"]["replayed_truth"] = _gap_of_truth(trial, index)
    return trial


def _gap_of_truth(trial: Trial, index: int) -> float:
    """RMS of the last log less the motion of the true robot without noise [rad].

    It is what a replay of a right model leaves, which has no noise either: noise moves a joint
    that dry friction or backlash holds, by more than itself.
    """
    assert trial.truth is not None
    last = trial.experiments[-1]
    (quiet, _), = run(trial.robot, [trial.truth], [last], [np.zeros_like(last.q_d)], seed=index)
    return float(np.sqrt(np.mean((trial.runs[-1][0] - quiet) ** 2)))


ONE_JOINT = Population(_draw, (12,))
