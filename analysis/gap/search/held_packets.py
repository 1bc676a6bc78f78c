"""Commands that a drive held: length, interval and phases of the holds that explain most."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.search.drive_errors import (
    DriveErrors,
    Use,
    drop_of,
    outstanding,
    power_of,
)

_LINES_OF_HOLD = 3  # of each length
_REFINED_HOLDS = 6  # lengths and intervals, those that explain most as they are
_HOLDS = 3, 8, 20, 45, 100  # samples
_INTERVALS = 0.05, 5.0  # s
_HARMONICS = 8
_FLAT = 1e-6  # of the most energy that holding a command adds: less is rounding


def no_hold(logs: int) -> Use:
    """Return holds of no length."""
    return Use(0.0, {"hold": 0.0, "interval": 1.0, "phase": np.zeros(logs)})


def best_hold(joint: DriveErrors) -> Use:
    """Return length, interval and phases of the stretches over which the command is held.

    The torque that the errors need tells where the loop answers at a few frequencies only, the
    errors sent back where that torque is mostly noise.
    """
    return max((_best_hold(joint, signals) for signals in (joint.back, joint.torque)), key=drop_of)


def _best_hold(joint: DriveErrors, signals: Sequence[np.ndarray]) -> Use:
    """Holds that look most like some signals, one per log.

    A line of the spectrum may be a harmonic, so that the holds come less often, or be made of
    every second or third harmonic, so that they come more often.
    """
    none, found = no_hold(len(joint.u)), []
    for length in _HOLDS:
        by_log = _stretches(joint, signals, length)
        of_lines = [(_hold(joint, by_log, length, interval), interval)
                    for interval in _intervals(joint, by_log, length)]
        line, interval = max(of_lines, key=_drop_of_line, default=(none, 0.0))
        found += [line, *(_hold(joint, by_log, length, share * interval)
                          for share in (1 / 3, 1 / 2, 2, 3) if share * interval > 2 * length)]
    likely = sorted(found, key=drop_of, reverse=True)[:_REFINED_HOLDS]
    if not likely or likely[0].drop <= joint.least:
        return likely[0] if likely and likely[0].drop > 0.0 else none
    best = max((_refined_hold(joint, signals, use, 1.0) for use in likely), key=drop_of)
    for step in (0.5, 0.25, 0.1):
        best = _refined_hold(joint, signals, best, step)
    return best


def _refined_hold(joint: DriveErrors, signals: Sequence[np.ndarray], best: Use, step: float,
                  ) -> Use:
    """Holds of another length, or more or less often, that explain more; by a share of a hold."""
    finest = 1.0 / max(len(u) for u in joint.u)
    hold, interval = (float(best.values[name]) / joint.period for name in ("hold", "interval"))
    tried = []
    for share in (1 - 0.5 * step, 1.0, 1 + 0.5 * step):
        length = max(1, round(hold * share))
        by_log = _stretches(joint, signals, length)
        tried += [_hold(joint, by_log, length, interval * (1 + shift))
                  for shift in step * hold * finest * np.arange(-4, 5)]
    return max([best, *tried], key=drop_of)


class _Stretches(NamedTuple):
    """What holding a command for some samples adds, by first sample, in one log.

    Its product with what the error holds of it, and its energy.
    """

    gain: np.ndarray
    energy: np.ndarray


def _stretches(joint: DriveErrors, signals: Sequence[np.ndarray], length: int,
               ) -> list[_Stretches]:
    """Stretches of a length [samples] in each log."""
    return [_stretches_in_log(u, signal, length) for u, signal in zip(joint.u, signals)]


def _stretches_in_log(u: np.ndarray, signal: np.ndarray, length: int) -> _Stretches:
    before = np.concatenate([[0.0], u[:-1]])[:len(u) - length]
    error, product, command, squared = (
        sums[length:-1] - sums[:-length - 1] for sums in (
            np.concatenate([[0.0], np.cumsum(x)]) for x in (signal, signal * u, u, u * u)))
    energy = length * before**2 - 2.0 * before * command + squared
    return _Stretches(before * error - product, np.maximum(energy, 0.0))


def _intervals(joint: DriveErrors, by_log: list[_Stretches], length: int) -> list[float]:
    """Intervals [samples] whose harmonics stand out together in the gains of a length."""
    length_of_log = max(len(joint.u[j]) for j in joint.fitted) * joint.period
    longest = min(_INTERVALS[1], 0.3 * length_of_log)
    shortest = max(_INTERVALS[0], 2 * length * joint.period)
    if shortest >= longest:
        return []
    frequency, power = power_of([by_log[j].gain for j in joint.fitted], joint.period,
                              (_HARMONICS + 1) / shortest)
    bins = np.arange(1, len(power) // (_HARMONICS + 1))
    comb = np.zeros(len(power))
    comb[bins] = sum(power[m * bins] for m in range(1, _HARMONICS + 1))
    return [1.0 / (line * joint.period) for line in outstanding(
        frequency, comb, 1.0 / longest, 1.0 / shortest, _LINES_OF_HOLD)]


def _hold(joint: DriveErrors, by_log: list[_Stretches], length: int, interval: float) -> Use:
    """Holds of a length at an interval, both in samples, with the best phase of each log.

    Where they begin is where the error looks most like what they add, as by a matched filter.
    """
    torques, phases = [], []
    for j, (u, of_log) in enumerate(zip(joint.u, by_log)):
        laps = np.round(np.arange(0.0, len(of_log.gain), interval)).astype(int)
        first = np.arange(int(interval))[:, None] + laps
        gain, energy = (np.concatenate([x, np.zeros(len(first))])[first].sum(axis=1)
                        for x in of_log)
        start = int(np.argmax(gain / np.sqrt(energy + _FLAT * energy.max() + 1e-300)))
        phases.append(-(start - 0.5) / interval % 1.0)
        if j in joint.fitted:
            torques.append(_held(u, start + laps, length) - u)
    return Use(joint.drop(torques), {"hold": length * joint.period,
                                     "interval": interval * joint.period,
                                     "phase": np.array(phases)})


def _held(u: np.ndarray, starts: np.ndarray, length: int) -> np.ndarray:
    """Command that rests for some samples from each start on."""
    held = np.concatenate([u, np.zeros(length)])
    starts = starts[starts < len(u)]
    before = np.where(starts > 0, u[starts - 1], 0.0)
    held[starts[:, None] + np.arange(length)] = before[:, None]
    return held[:len(u)]


def _drop_of_line(line: tuple[Use, float]) -> float:
    return line[0].drop
