"""Sensitivities of a joint under a sampled law, exactly as the loop is sampled.

With the plant P = 1/(inertia s^2 + damping s) held over a sample, and the law C = kp + kd F,

    S_tau = P / (1 + P C)  (torque -> position),   S_0 = 1 / (1 + P C)  (sensor error -> measured).
"""

import functools

import numpy as np

Polynomials = tuple[np.ndarray, np.ndarray]  # numerator and denominator in powers of z^-1
SLOWEST = 1e-6  # 1/s, damping over inertia


def held_plant(inertia: float, damping: float, period: float) -> Polynomials:
    """Pulse transfer function of ``inertia ddq + damping dq = u`` behind a zero-order hold.

    A joint with next to no damping is given a time constant of eleven days, beyond which the
    formulas lose digits.
    """
    rate = damping / inertia
    rate = rate if abs(rate) >= SLOWEST else SLOWEST
    kept, lost = np.exp(-rate * period), -np.expm1(-rate * period)
    speed = lost / rate / inertia
    position = (rate * period - lost) / rate**2 / inertia
    drift = lost / rate
    # x+ = [1 drift; 0 kept] x + [position; speed] u
    return (np.array([0.0, position, speed * drift - position * kept]),
            np.array([1.0, -1.0 - kept, kept]))


def loop_polynomials(plant: Polynomials, kp: float, kd: float, velocity_filter: Polynomials,
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numerators of S_tau and S_0, and their common denominator, in powers of ``z^-1``."""
    rate_b, rate_a = velocity_filter
    return closed_loop(plant, (kp * rate_a + kd * rate_b, rate_a))


def closed_loop(plant: Polynomials, feedback: Polynomials,
                ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numerators of S_tau and S_0, and their common denominator, of a plant and any law C."""
    (b, a), (controller, denominator) = plant, feedback
    torque, sensor = np.convolve(b, denominator), np.convolve(a, denominator)
    return torque, sensor, sensor + np.convolve(b, controller)


def decimated_filter(b: np.ndarray, a: np.ndarray, width: int, stride: int = 1) -> Polynomials:
    """Filter from means over blocks of `width` samples to means over blocks of its output.

    It is exact for an input that is constant over each block, at a fraction of the cost.  Of the
    output every sample is seen, or one in `stride`.
    """
    return _decimated(tuple(b), tuple(a), width, stride)


@functools.lru_cache(maxsize=256)
def _decimated(numerator: tuple[float, ...], denominator: tuple[float, ...], width: int,
               stride: int) -> Polynomials:
    """`decimated_filter` of each loop once: a search asks for it a thousand times."""
    b, a = np.array(numerator), np.array(denominator)
    order = len(a) - 1
    step = np.eye(order, k=-1)
    step[0] = -a[1:] / a[0]
    out, direct = (b[1:] - b[0] * a[1:] / a[0]) / a[0], b[0] / a[0]
    state, driven = np.eye(order), np.zeros(order)
    seen, through = np.zeros(order), 0.0
    count = width // stride
    for sample in range(width):
        if sample % stride == 0:
            seen, through = seen + out @ state / count, through + (out @ driven + direct) / count
        state, driven = step @ state, step @ driven + np.eye(order)[0]
    decimated = np.poly(state)
    result = np.poly(state - np.outer(driven, seen)) + (through - 1.0) * decimated, decimated
    for polynomial in result:
        polynomial.setflags(write=False)
    return result
