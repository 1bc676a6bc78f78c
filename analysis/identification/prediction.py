"""Prediction of a log that was not used: the model under the stated law, from the start alone."""

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.identification.regression import Estimate
from clie_blocks.analysis.identification.signals_of_log import (
    command,
    excitation,
    reference,
    robot_of,
)
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import sample_time


@dataclasses.dataclass(frozen=True, eq=False)
class Prediction:
    """How well an estimate predicts a log, per joint.

    Parameters
    ----------
    source : str
        The log.
    method : str
        Whose estimate.
    position_rms, moved_rms : ndarray, shape (n,)
        Error of the predicted position, and size of the motion [unit of q].
    input_rms, command_rms : ndarray, shape (n,)
        Input error (26), and size of the command [unit of u].
    noise : ndarray, shape (n,)
        Noise of the measured position, below which no model can get [unit of q].

    """

    source: str
    method: str
    position_rms: np.ndarray
    moved_rms: np.ndarray
    input_rms: np.ndarray
    command_rms: np.ndarray
    noise: np.ndarray


def predict(record: Record, load: np.ndarray, k: int,
            estimate: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """Position and command, shape (N,), of one joint's model under the stated law.

    It starts at the first measured position at rest, driven by reference, excitation and a known
    load torque of shape (N,).  The plant is solved exactly over each held command; dry friction
    is set-valued: it holds the joint at rest as long as it can.
    """
    step = sample_time(record, robot_of(record).controller)
    law = _law(record, k, step)
    plant = _plant(estimate, step)
    q, dq = float(record.q[0, k]), 0.0
    out = np.empty((2, len(record)))
    for i, outside in enumerate(load.tolist()):
        u = law(i, q)
        out[:, i] = q, u
        q, dq = plant(q, dq, u - outside)
    return out[0], out[1]


def _law(record: Record, k: int, step: float) -> Callable[[int, float], float]:
    """Stated law as a function of sample and position, with the memory of its velocity filter."""
    law = control_law(robot_of(record).controller, step)
    kp, kd, limit = (float(value[k]) for value in (law.kp, law.kd, law.saturation))
    b, a = law.numerator[:, k].tolist(), law.denominator[:, k].tolist()
    feedforward = (kp * reference(record)[:, k] + excitation(record)[:, k]).tolist()
    first = float(record.q[0, k])
    memory = [0.0] * len(b)

    def law_of(i: int, q: float) -> float:
        x = q - first  # at rest at the first position the filter holds nothing
        rate = b[0] * x + memory[0]
        for j in range(len(b) - 1):
            memory[j] = b[j + 1] * x - a[j + 1] * rate + memory[j + 1]
        return min(max(feedforward[i] - kp * q - kd * rate, -limit), limit)

    return law_of


def _plant(estimate: Estimate,
           step: float) -> Callable[[float, float, float], tuple[float, float]]:
    """One step of ``J ddq + F dq + c + weight + dry friction = torque``, torque held."""
    values = dict(zip(estimate.names, estimate.value.tolist(), strict=True))
    inertia, viscous = values["inertia"], values["viscous"]
    dry, offset = values.get("coulomb", 0.0), values["offset"]
    wc, ws = values.get("weight_cos", 0.0), values.get("weight_sin", 0.0)
    rate = viscous / inertia * step
    forget = math.exp(-rate)
    kept = step * (-math.expm1(-rate) / rate if rate else 1.0)  # travel per speed
    gain = kept / inertia  # speed per torque
    reach = (step * step / inertia) * ((rate - 1 + forget) / rate**2 if abs(rate) > 1e-4
                                       else 0.5 - rate / 6)

    def advance(q: float, dq: float, torque: float) -> tuple[float, float]:
        torque -= offset + wc * math.cos(q) + ws * math.sin(q)
        free = forget * dq + gain * torque
        hold = min(max(free / gain, -dry), dry)  # torque that friction needs to stop the joint
        return q + kept * dq + reach * (torque - hold), free - gain * hold

    return advance


def predict_log(record: Record, load: np.ndarray, estimates: Sequence[Estimate],
                noise: np.ndarray) -> Prediction:
    """Errors over the valid samples of a log, predicted with one estimate per joint.

    The known load torque has shape (N, n), the noise of q shape (n,).
    """
    runs = [predict(record, load[:, k], k, estimate) for k, estimate in enumerate(estimates)]
    q, u = (np.stack([run[i] for run in runs], axis=1) for i in (0, 1))
    used = record.valid
    return Prediction(record.source, estimates[0].method, _rms((record.q - q)[used]),
                      record.q[used].std(axis=0), _rms((u - command(record))[used]),
                      _rms(command(record)[used]), noise)


def _rms(x: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(x**2, axis=0))
