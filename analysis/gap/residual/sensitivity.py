"""Sensitivities of the closed loop: how a torque, and a sensor error, reach the measured position.

With the law known, the closed-loop prediction error is an exact linear filter of the equation
error.  Per joint, with the plant P = 1/(inertia s^2 + damping s) held over a sample, and the law
C = kp + kd F,

    S_tau = P / (1 + P C)  (torque -> position),   S_0 = 1 / (1 + P C)  (sensor error -> measured).
"""

import numpy as np

from clie_blocks.analysis.gap.problem.planar_chain import mass_matrix
from clie_blocks.linear_filters import lfilter

LENGTH = 4000  # samples of an impulse response
SPARSE = 50  # samples of a log between two poses


def held_plant(inertia, damping, period):
    """Pulse transfer function of inertia ddq + damping dq = u with held u: ``numerator, a``."""
    rate = max(damping / inertia, 1e-6)
    left, lost = np.exp(-rate * period), -np.expm1(-rate * period)
    speed = lost / rate / inertia
    way = (rate * period - lost) / rate**2 / inertia
    drift = lost / rate
    # x+ = [1 drift; 0 left] x + [way; speed] u
    return (np.array([0.0, way, speed * drift - way * left]),
            np.array([1.0, -1.0 - left, left]))


def loop_polynomials(law, k, inertia, damping):
    """Numerators of S_tau and S_0, and their common denominator, for joint k."""
    b, a = held_plant(inertia, damping, law.period)
    rate_b, rate_a = law.numerator[:, k], law.denominator[:, k]
    controller = law.kp[k] * rate_a + law.kd[k] * rate_b
    torque, sensor = np.convolve(b, rate_a), np.convolve(a, rate_a)
    return torque, sensor, sensor + np.convolve(b, controller)


def torque_sensitivity(law, k, inertia, damping):
    """S_tau(z) of joint k: ``numerator, denominator``, position per torque [rad/(N m)]."""
    if law.variant == "loop":
        return law.torque[k]
    torque, _, denominator = loop_polynomials(law, k, inertia, damping)
    return torque, denominator


def sensor_sensitivity(law, k, inertia, damping):
    """S_0(z) of joint k: ``numerator, denominator``, measured position per sensor error."""
    if law.variant == "loop":
        return law.sensor[k]
    _, sensor, denominator = loop_polynomials(law, k, inertia, damping)
    return sensor, denominator


def noise_responses(problem, k, inertia, damping):
    """Error of joint k after a unit impulse on the sensor of each joint, n arrays of LENGTH.

    A joint that follows the noise of its own sensor pushes the others by the mass that they
    share: its mean square over the logs is taken, to first order.
    """
    law, impulse, found = problem.law, np.eye(1, LENGTH)[0], []
    for j, shared in enumerate(_shared_mass(problem, k)):
        own = lfilter(*sensor_sensitivity(law, j, inertia[j], damping[j]), impulse)
        if j != k:
            pull = shared * np.diff(own - impulse, 2, prepend=(0.0, 0.0)) / problem.period**2
            own = lfilter(*torque_sensitivity(law, k, inertia[k], damping[k]), pull)
        found.append(own)
    return found


def _shared_mass(problem, k):
    """RMS over the logs of the mass that joint k shares with each joint, motor side."""
    q = np.concatenate([log.q[::SPARSE] for log in problem.logs])
    row = mass_matrix(problem.chain, q)[k]
    return np.array([np.sqrt(np.mean(np.square(m))) for m in row]) / problem.gear_ratio[k]


def decimated_filter(b, a, width):
    """Filter from means over blocks of samples to means over blocks of its output.

    It is exact for an input that is constant over each block, at a fraction of the cost.

    Parameters
    ----------
    b, a : ndarray
        Numerator and denominator at the rate of the samples.
    width : int
        Samples per block.

    Returns
    -------
    b, a : ndarray
        Numerator and denominator at the rate of the blocks.

    """
    order = len(a) - 1
    step = np.eye(order, k=-1)
    step[0] = -a[1:] / a[0]
    out, direct = (b[1:] - b[0] * a[1:] / a[0]) / a[0], b[0] / a[0]
    state, driven = np.eye(order), np.zeros(order)
    seen, through = np.zeros(order), 0.0
    for _ in range(width):
        seen, through = seen + out @ state / width, through + (out @ driven + direct) / width
        state, driven = step @ state, step @ driven + np.eye(order)[0]
    denominator = np.poly(state)
    return np.poly(state - np.outer(driven, seen)) + (through - 1.0) * denominator, denominator
