"""Control laws sample by sample, as controllers compute them; of no block of the package.

A law reads `Signals` and returns the command at the motors, shape (n,) [N m], or a duty cycle.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.laws.arm import PERIOD, Arm


@dataclasses.dataclass(frozen=True, eq=False)
class Signals:
    """What a law reads in one sample, each of shape (n,) [rad, rad/s, rad/s^2].

    Parameters
    ----------
    q_d, dq_d, ddq_d : ndarray
        Reference, as its generator knows it.
    q, rate : ndarray
        Measured position, and its backward difference over the period.

    """

    q_d: np.ndarray
    dq_d: np.ndarray
    ddq_d: np.ndarray
    q: np.ndarray
    rate: np.ndarray


Law = Callable[[Signals], np.ndarray]
Gains = np.ndarray | float
WIDTH = 0.02  # rad/s, over which a friction that is fed forward changes its sign


def pd(kp: Gains, kd: Gains, velocity: Gains = 0.0, acceleration: Gains = 0.0,
       coulomb: Gains = 0.0) -> Law:
    """PD on the joint's velocity, with feedforward of the reference."""
    return lambda s: (kp * (s.q_d - s.q) - kd * s.rate + velocity * s.dq_d
                      + acceleration * s.ddq_d + coulomb * np.tanh(s.dq_d / WIDTH))


def pd_of_error(kp: Gains, kd: Gains) -> Law:
    """PD on the backward difference of the error."""
    last: np.ndarray | None = None

    def law(s: Signals) -> np.ndarray:
        nonlocal last
        error = s.q_d - s.q
        rate, last = (error - (error if last is None else last)) / PERIOD, error
        return kp * error + kd * rate
    return law


def pid(kp: Gains, ki: Gains, kd: Gains, limit: Gains = np.inf, holds: bool = True,
        velocity: Gains = 0.0) -> Law:
    """PID with feedforward within a limit; its integral stands still there, or winds up."""
    total: Gains = 0.0

    def law(s: Signals) -> np.ndarray:
        nonlocal total
        error = s.q_d - s.q
        grown = total + ki * PERIOD * error
        free = kp * error + grown - kd * s.rate + velocity * s.dq_d
        limited = np.clip(free, -limit, limit)
        stands = holds & (free != limited) & (error * free > 0.0)
        total = np.where(stands, total, grown)
        return limited
    return law


def cascade(kp: Gains, kv: Gains, ki: Gains, every: int = 1) -> Law:
    """Position P around velocity PI, the outer loop each `every` samples."""
    total: Gains = 0.0
    wanted: Gains = 0.0
    count = 0

    def law(s: Signals) -> np.ndarray:
        nonlocal total, wanted, count
        if count % every == 0:
            wanted = kp * (s.q_d - s.q)
        count += 1
        error = wanted - s.rate
        total = total + ki * PERIOD * error
        return kv * error + total
    return law


def with_low_pass(law: Law, corner: Gains) -> Law:
    """A law whose command passes a first-order low-pass [rad/s]."""
    share, state = 1.0 - np.exp(-corner * PERIOD), np.zeros(1)

    def filtered(s: Signals) -> np.ndarray:
        nonlocal state
        state = state + share * (law(s) - state)
        return state
    return filtered


def with_error_low_pass(law: Law, corner: Gains) -> Law:
    """A law that reads the error behind a first-order low-pass [rad/s]."""
    share, state = 1.0 - np.exp(-corner * PERIOD), np.zeros(1)

    def filtered(s: Signals) -> np.ndarray:
        nonlocal state
        state = state + share * (s.q_d - s.q - state)
        return law(dataclasses.replace(s, q_d=s.q + state))
    return filtered


def with_rate_limit(law: Law, largest: Gains) -> Law:
    """A law whose command moves by no more than a rate [N m/s]."""
    last = np.zeros(1)

    def limited(s: Signals) -> np.ndarray:
        nonlocal last
        last = last + np.clip(law(s) - last, -largest * PERIOD, largest * PERIOD)
        return last
    return limited


def with_weight(law: Law, arm: Arm) -> Law:
    """A law that also holds the weight of the links at the measured position."""
    still = np.zeros(arm.n)
    return lambda s: law(s) + arm.terms(s.q, still)[1] / arm.gear


def with_inverse_dynamics(law: Law, arm: Arm, share: float) -> Law:
    """A law beside the torque of the reference, by a model that is off by a factor."""
    def fed(s: Signals) -> np.ndarray:
        mass, bias = arm.terms(s.q_d, s.dq_d)
        return law(s) + share * (mass @ s.ddq_d + bias) / arm.gear
    return fed


def computed_torque(arm: Arm, kp: Gains, kd: Gains, share: float) -> Law:
    """M(q) (ddq_d + kp e + kd de) + C(q, dq) dq + G(q), by a model that is off by a factor."""
    def law(s: Signals) -> np.ndarray:
        wanted = s.ddq_d + kp * (s.q_d - s.q) + kd * (s.dq_d - s.rate)
        mass, bias = arm.terms(s.q, s.rate)
        return share * (mass @ wanted + bias) / arm.gear
    return law


def servo(kp: Gains, dead: Gains, punch: Gains) -> Law:
    """Duty cycle of a hobby servo: dead band, punch, full duty at most."""
    def law(s: Signals) -> np.ndarray:
        error = s.q_d - s.q
        beyond = np.sign(error) * np.maximum(np.abs(error) - dead, 0.0)
        return np.clip(kp * beyond + punch * np.sign(beyond), -1.0, 1.0)
    return law
