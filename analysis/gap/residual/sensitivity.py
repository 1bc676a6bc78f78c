"""How noise on a sensor reaches the prediction error, through the sensitivities of the loop.

With the law known, the closed-loop prediction error is an exact linear filter of the equation
error.  Per joint, with the plant P = 1/(inertia s^2 + damping s) held over a sample, and the law
C = kp + kd F,

    S_tau = P / (1 + P C)  (torque -> position),   S_0 = 1 / (1 + P C)  (sensor error -> measured).

The law of a problem returns both as digital filters.
"""

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.linear_filters import lfilter
from clie_blocks.robot_loop.links import mass_rows

_LENGTH = 4000  # samples of an impulse response
_POSE_SPACING = 50  # samples of a log between two poses


def noise_responses(problem: Problem, k: int, inertia: np.ndarray, damping: np.ndarray,
                    ) -> list[np.ndarray]:
    """Error of joint k after a unit impulse on the sensor of each joint, one array per joint.

    Where a measured torque drives the models, which has noise as well, the last array is the error
    after a unit impulse of it.
    A joint that follows the noise of its own sensor pushes the others by the mass that they
    share: its mean square over the logs is taken, to first order.
    """
    law, impulse, responses = problem.law, np.eye(1, _LENGTH)[0], []
    for j, shared in enumerate(_shared_mass(problem, k)):
        response = lfilter(*law.sensor_sensitivity(j, inertia[j], damping[j]), impulse)
        if j != k:
            motion = np.diff(response - impulse, 2, prepend=(0.0, 0.0))
            push = shared * motion / problem.period**2
            response = lfilter(*law.torque_sensitivity(k, inertia[k], damping[k]), push)
        responses.append(response)
    if isinstance(law, StatedLaw) and law.measured_torque:
        responses.append(lfilter(*law.torque_sensitivity(k, inertia[k], damping[k]), impulse))
    return responses


def _shared_mass(problem: Problem, k: int) -> np.ndarray:
    """RMS over the logs of the mass that joint k shares with each joint, motor side."""
    q = np.concatenate([log.q[::_POSE_SPACING] for log in problem.logs])
    row = mass_rows(problem.links, q)[k]
    return np.array([np.sqrt(np.mean(np.square(m))) for m in row]) / problem.gear_ratio[k]
