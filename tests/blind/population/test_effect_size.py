"""The size of an effect is what the refitted joint model cannot explain."""

import dataclasses

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.population.effect_size import (
    reference,
    relative_prediction_error,
    size_ratio,
)


def _noisy(robot):
    return dataclasses.replace(robot, sigma=np.full(robot.n, 1e-4))


def test_a_change_of_the_joint_model_leaves_no_trace_after_the_refit(quiet_robot):
    joint = quiet_robot()
    there_and_back = 0.3 * joint.robot.kp * np.sin(4 * np.arange(2000) * 1e-3)[:, None]
    experiments = [dataclasses.replace(joint.experiment(2.0), pe=there_and_back),
                   joint.experiment(2.0, angle=0.2)]
    noises = [np.zeros(experiment.q_d.shape) for experiment in experiments]
    robot = _noisy(joint.robot)
    ref = reference(robot, joint.truth, experiments, noises)
    heavier = {**joint.truth, "rotor": 1.02 * joint.truth["rotor"],
               "drag": 1.05 * joint.truth["drag"]}
    rubbing = {**joint.truth, "level": 3e-3 * robot.kp}
    runs = [run(robot, [lane] * 2, experiments, noises)
            for lane in (joint.truth, heavier, rubbing)]
    ratios = [size_ratio(relative_prediction_error(robot, ref, one)) for one in runs]
    assert ratios[0] == 1.0 and ratios[1] < 1.05 and ratios[2] > 3


def test_a_refit_within_tolerances_follows_no_rotor_far_beyond_its_own(quiet_robot):
    """Where the noise says little, the datasheet counts; a rotor within it costs nothing."""
    joint = quiet_robot()
    moving = 0.3 * joint.robot.kp * np.sin(4 * np.arange(2000) * 1e-3)[:, None]
    experiments = [dataclasses.replace(joint.experiment(2.0), pe=moving)] * 2
    noises = [np.zeros(experiment.q_d.shape) for experiment in experiments]
    robot = dataclasses.replace(joint.robot, sigma=np.full(joint.robot.n, 1e-3))
    lanes = [{**joint.truth, "rotor": share * joint.truth["rotor"]} for share in (1.005, 1.3)]
    runs = [run(robot, [lane] * 2, experiments, noises) for lane in lanes]
    within, free = ([size_ratio(relative_prediction_error(robot, ref, one)) for one in runs]
                    for ref in (reference(robot, joint.truth, experiments, noises, held)
                                for held in (True, False)))
    assert within[0] < 1.01 and free[0] < 1.01
    assert within[1] - 1.0 > 1.5 * (free[1] - 1.0)
