"""What loggers and exporters do to the channels of a log: units, sides, signs, order, noise.

Every function changes an `Export` in place and returns what it chose, for the label.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.imperfect.export import (
    DoesNotApplyError,
    Export,
    columns,
)

Choice = dict[str, Any]
Change = Callable[[Export, np.random.Generator], Choice]
NOT_NUMBERS = 10  # rows of each log
STEP_12_BIT = 2 * np.pi / 4096  # rad
THIRD_DIFFERENCE = np.sqrt(20.0)  # standard deviation by that of the samples, white noise
MAD_TO_STD = 1.4826


def scale(factor: float, *signals: str) -> Change:
    """Return the change to another unit, which no header mentions."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        export.change(signals, lambda x: factor * x)
        return {"factor": factor}
    return change


def percent_of_rated(export: Export, rng: np.random.Generator) -> Choice:
    """Torques in percent of the rated torque, as drives report them."""
    peak = export.stated("motor", "peak_torque_nm")
    rated = np.array([float(f"{x:.2g}") for x in peak / rng.uniform(2.0, 4.0, peak.size)])
    export.change(("u", "pe"), lambda x: 100 * x / rated)
    return {"rated": rated.tolist()}


def joint_side(export: Export, rng: np.random.Generator) -> Choice:
    """Torques on the joint side."""
    ratio = export.stated("motor", "gear_ratio")
    if ratio.max() < 1.5:
        raise DoesNotApplyError("both sides of the gear are the same")
    export.change(("u", "pe"), lambda x: ratio * x)
    return {}


def turn_sign(signal: str) -> Change:
    """Return the change of sign of a signal at one joint."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        k = int(rng.integers(export.joints))
        sign = np.where(np.arange(export.joints) == k, -1.0, 1.0)
        export.change((signal,), lambda x: sign * x + 0.0)
        return {"joint": k + 1}
    return change


def swap(signal: str) -> Change:
    """Return the swap of a signal between two joints."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        if export.joints < 2:
            raise DoesNotApplyError("one joint")
        one, other = sorted(map(int, rng.choice(export.joints, 2, replace=False)))
        order = np.arange(export.joints)
        order[[one, other]] = order[[other, one]]
        export.change((signal,), lambda x: x[:, order])
        return {"joints": [one + 1, other + 1]}
    return change


def late_command(export: Export, rng: np.random.Generator) -> Choice:
    """Commands that arrive some samples late, at all joints."""
    late = int(rng.integers(3, 11))
    export.change(("u",), lambda x: _delayed(x, late))
    return {"samples": late}


def late_position(export: Export, rng: np.random.Generator) -> Choice:
    """Position of one joint that arrives some samples late."""
    k, late = int(rng.integers(export.joints)), int(rng.integers(3, 11))
    export.change(("q",), lambda x: np.where(np.arange(x.shape[1]) == k, _delayed(x, late), x))
    return {"joint": k + 1, "samples": late}


def _delayed(x: np.ndarray, late: int) -> np.ndarray:
    return np.concatenate([np.repeat(x[:1], late, axis=0), x[:-late]])


def shift_position(*signals: str) -> Change:
    """Return the change of the zero of one joint."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        if "qd" in signals and not export.stated("nominal", "gravity"):
            raise DoesNotApplyError("nothing depends on the pose")
        k, offset = int(rng.integers(export.joints)), rng.choice([-1, 1]) * rng.uniform(0.1, 0.3)
        shift = np.where(np.arange(export.joints) == k, round(float(offset), 4), 0.0)
        export.change(signals, lambda x: x + shift)
        return {"joint": k + 1, "offset": round(float(offset), 4)}
    return change


def hold(signal: str) -> Change:
    """Return the change to a dead channel: the first value of one joint, for ever."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        k = int(rng.integers(export.joints))
        export.change((signal,), lambda x: np.where(np.arange(x.shape[1]) == k, x[:1], x))
        return {"joint": k + 1}
    return change


def lose(signal: str) -> Change:
    """Return the loss of a signal; one that is zero in all logs is not missed."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        logs = export.logs.values()
        if not any(np.ptp(table[name]) for table in logs for name in columns(table, signal)):
            raise DoesNotApplyError(f"{signal} does not change")
        for table in logs:
            for name in columns(table, signal):
                del table[name]
        return {}
    return change


def coarse_position(export: Export, rng: np.random.Generator) -> Choice:
    """Position with 12 bit per turn; the controller has the finer one."""
    export.change(("q",), lambda x: STEP_12_BIT * np.round(x / STEP_12_BIT))
    return {}


def sense_with_noise(factor: float) -> Change:
    """Return the growth of the encoders' noise, which the controller reads and acts on."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        if export.with_noise is None:
            raise DoesNotApplyError("noise in the loop needs the robot, and not only its logs")
        export.logs = export.with_noise(factor).logs
        return {"factor": factor}
    return change


def add_noise(factor: float) -> Change:
    """Return the growth of the noise of the logged position by a factor.

    The controller did not read it: a logger with an analogue input of its own, a radio link.
    """
    def change(export: Export, rng: np.random.Generator) -> Choice:
        step = float(np.max(export.stated("encoder", "resolution_rad")))

        def noisy(x: np.ndarray) -> np.ndarray:
            rough = np.abs(np.diff(x, 3, axis=0))
            noise = MAD_TO_STD * np.median(rough, axis=0) / THIRD_DIFFERENCE
            x = x + np.sqrt(factor**2 - 1) * noise * rng.standard_normal(x.shape)
            return step * np.round(x / step)
        export.change(("q",), noisy)
        return {"factor": factor}
    return change


def lose_values(export: Export, rng: np.random.Generator) -> Choice:
    """NaN in the position of one joint, here and there."""
    k = int(rng.integers(export.joints))
    for table in export.logs.values():
        name = columns(table, "q")[k]
        rows = rng.choice(np.arange(1, table[name].size), NOT_NUMBERS, replace=False)
        table[name][rows] = np.nan
    return {"joint": k + 1, "values": NOT_NUMBERS}
