"""The loop against its exact solution, and copies that diverge."""

import numpy as np
import pytest
from scipy.linalg import expm

from clie_blocks.analysis.blind.engine.control_loop import DIVERGED, run

TORQUES = ("dead", "ripple", "tone", "bias", "stiffness", "quadratic", "bristle", "warm_level",
           "warm_drag", "fault_torque", "fault_drag", "fault_level", "wavy_level", "wavy_drag",
           "wandering", "random", "integral", "stop_stiffness")


def _exact(joint, u):
    """Angle under held commands, by matrix exponential."""
    robot, p = joint.robot, joint.truth
    ratio = robot.ratio[0]
    inertia = p["rotor"][0] * ratio**2 + robot.mass[0] * robot.com[0]**2 + robot.inertia[0]
    damping = p["drag"][0] * ratio**2 + robot.bearing[0]
    matrix = np.array([[0, 1, 0], [0, -damping / inertia, ratio / inertia], [0, 0, 0]])
    step, state, found = expm(robot.period * matrix), np.zeros(2), []
    for torque in u[:, 0]:
        found.append(robot.pose[0] + state[0])
        state = (step @ [*state, torque])[:2]
    return np.array(found)[:, None]


def test_a_healthy_joint_moves_as_the_exact_solution_of_its_equation(quiet_robot):
    joint = quiet_robot()
    robot = joint.robot
    experiment = joint.experiment(2.0, torque=0.1 * robot.kp)
    q, u = joint.run(experiment)
    assert q == pytest.approx(_exact(joint, u), abs=2e-8)
    assert np.ptp(q) > 0.05


@pytest.mark.parametrize("parameters", [
    {"dead": 1e-2}, {"ripple": 1e-2, "poles": 9.0}, {"tone": 1e-2}, {"bias": 1e-2},
    {"stiffness": 5.0}, {"quadratic": 1.0}, {"bristle": 1e-2, "bristle_range": 5e-3},
    {"warm_level": 1e-2}, {"warm_drag": 0.1}, {"fault_torque": 1e-2}, {"fault_drag": 0.1},
    {"fault_level": 1e-2}, {"wavy_level": 2e-2, "waves": 8.0}, {"wavy_drag": 0.1, "waves": 8.0},
    {"wandering": 0.1}, {"random": 1e-2}, {"lost": 0.2}, {"heating": 100.0}, {"sag": 0.2},
    {"eccentric": 1e-2}, {"step": 1e-2}, {"corner": 0.5}, {"integral": 0.5}, {"kp_factor": 1.1},
    {"gain": 1.1}, {"hard_stop": 0.02}, {"wall": 2e-3}, {"stop": 0.02, "stop_stiffness": 0.1}],
    ids=lambda n: next(iter(n)))
def test_each_parameter_moves_the_robot_and_its_neutral_value_does_not(quiet_robot, parameters):
    joint = quiet_robot()
    scale = {key: value * joint.robot.kp if key in TORQUES else value
             for key, value in parameters.items()}
    for key in {"stop", "hard_stop"} & set(scale):
        scale[key] = scale[key] + joint.robot.pose
    experiment = joint.experiment(1.0, torque=0.2 * joint.robot.kp)
    healthy = joint.run(experiment)[0]
    assert np.max(np.abs(joint.run(experiment, **scale)[0] - healthy)) > 1e-5
    neutral = {key: joint.truth[key] for key in parameters}
    assert np.array_equal(joint.run(experiment, **neutral)[0], healthy)


def test_a_diverging_copy_does_not_spoil_its_neighbours(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(0.5, torque=0.2 * joint.robot.kp)
    noise = np.zeros(experiment.q_d.shape)
    unstable = {**joint.truth, "drag": np.full(joint.robot.n, -10.0)}
    logs = run(joint.robot, [joint.truth, unstable], [experiment] * 2, [noise] * 2)
    (q, _), (diverged, _) = logs
    alone = joint.run(experiment)[0]
    assert np.max(np.abs(q - alone)) < 1e-9
    assert np.all(diverged == DIVERGED)
