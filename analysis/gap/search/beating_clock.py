"""Clock of a drive that beats against that of its commands: the saw-tooth that explains most.

Over each beat the age of the command that acts grows, and then falls back.  What the error has in
common with a command of each age is one signal; a beat that explains the error has the youngest
at its start and the oldest at its end.  The spectra of these signals at the harmonics of a beat
give what it explains for every beat and every phase at once, as a matched filter does.
"""

import operator
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.drive import OLDEST_COMMAND
from clie_blocks.analysis.gap.search.drive_errors import DriveErrors, Use, drop_of

_SPREADS = 2, 8, 32, 100  # samples: largest age of a command
_SCALES = 0.2, 2.0  # of a spread, that its ages stand for
_AGES = 16  # into which a beat is cut
_HARMONICS = 4
_PHASES = 16
_BEATS = 0.2, 40.0  # Hz: slower ones do not come back in a log, faster ones the loop averages
_PADDED = 2  # times the length of a log, of its transform
_LIKELY, _APART = 3, 4  # beats of each spread, and bins between them
_TRIED = 4  # of them all
_FLAT = 1e-3  # of the mean energy that a beat adds: less is rounding

_ROUNDS = 2  # of refinement
_PHASES_AROUND = [np.arange(_PHASES) / _PHASES,
                  *(step * np.arange(-1, 2) for step in (1 / 32, 1 / 64, 1 / 128))]
_BEATS_AROUND = 0.25 * np.arange(-6, 7), 0.08 * np.arange(-2, 3), 0.02 * np.arange(-2, 3)
"""Turns by which phases may be off, and beats over the longest log; coarse, then fine."""

Values = dict[str, float | np.ndarray]


def no_beat(logs: int) -> Use:
    """Return a clock that does not beat."""
    return Use(0.0, {"spread": 0.0, "beat": 1.0, "phase": np.zeros(logs)})


def best_beat(joint: DriveErrors) -> Use:
    """Return the spread, the beat and the phases that explain most."""
    best, likely = no_beat(len(joint.u)), []
    for spread in sorted({min(spread * joint.period, OLDEST_COMMAND) for spread in _SPREADS}):
        ages = [_ages(u, torque, spread / joint.period)
                for u, torque in zip(joint.u, joint.torque)]
        likely += [(score, spread, beat, ages) for score, beat in _likely(joint, ages)]
    likely.sort(key=operator.itemgetter(0), reverse=True)
    for _, spread, beat, ages in likely[:_TRIED]:
        best = max(best, _beat(joint, ages, spread, beat), key=drop_of)
    if best.drop <= joint.least:
        return best
    for _ in range(_ROUNDS):
        best = _with_best_spread(joint, _with_best_beat(joint, _with_best_phases(joint, best)))
    return best


class _Ages(NamedTuple):
    """What a command of each age adds in one log, both of shape (_AGES, N).

    Its product with the torque that the error needs, and its energy.
    """

    gain: np.ndarray
    energy: np.ndarray


def _ages(u: np.ndarray, torque: np.ndarray, spread: float) -> _Ages:
    """Commands of ages up to a spread [samples]."""
    added = np.stack([_aged(u, age) - u for age in spread * (np.arange(_AGES) + 0.5) / _AGES])
    return _Ages(torque * added, added**2)


def _aged(u: np.ndarray, age: np.ndarray | float) -> np.ndarray:
    """Command of some samples ago."""
    ticks = np.arange(len(u))
    return np.interp(ticks - age, ticks, u)


def _likely(joint: DriveErrors, ages: Sequence[_Ages]) -> list[tuple[float, float]]:
    """Return the beats [Hz] that may explain most, each behind its score."""
    width = max(1, int(1.0 / (2.0 * _HARMONICS * _BEATS[1] * joint.period)))
    size = 1 << (_PADDED * max(len(joint.u[j]) for j in joint.fitted) // width).bit_length()
    finest = 1.0 / (size * width * joint.period)
    bins = np.arange(int(_BEATS[0] / finest) + 1, min(int(_BEATS[1] / finest),
                                                      size // (2 * _HARMONICS)))
    score = np.zeros(len(bins))
    for j in joint.fitted:
        gain, energy = (_by_phase(signals, width, size, bins) for signals in ages[j])
        score += (np.maximum(gain, 0.0) ** 2
                  / np.maximum(energy, _FLAT * energy.mean() + 1e-300)).max(axis=0)
    beats = []
    for _ in range(min(_LIKELY, len(bins))):
        best = int(np.argmax(score))
        beats.append((float(score[best]), float(bins[best] * finest)))
        score[max(best - _APART, 0):best + _APART + 1] = 0.0
    return beats


def _by_phase(signals: np.ndarray, width: int, size: int, bins: np.ndarray) -> np.ndarray:
    """Sum of one signal per age, each while it is its turn, by phase and beat (_PHASES, bins)."""
    rows = signals.shape[1] // width
    slow = signals[:, :rows * width].reshape(len(signals), rows, width).sum(axis=2)
    spectra, turns = np.fft.rfft(slow, size), (np.arange(_AGES) + 0.5) / _AGES
    harmonics = np.zeros((_PHASES // 2 + 1, len(bins)), complex)
    for n in range(_HARMONICS + 1):
        share = np.sinc(n / _AGES) * _PHASES / _AGES
        harmonics[n] = share * np.exp(2j * np.pi * n * turns) @ spectra[:, n * bins]
    return np.fft.irfft(harmonics, _PHASES, axis=0)


def _beat(joint: DriveErrors, ages: Sequence[_Ages], spread: float, beat: float) -> Use:
    """Saw-tooth of a beat with its best phases, and the spread with which it explains most."""
    phases = np.array([_phase(of_log, beat * joint.period) for of_log in ages])
    return _with_best_spread(joint, _use(joint, {"spread": spread, "beat": beat,
                                                 "phase": phases}))


def _phase(ages: _Ages, beat: float) -> float:
    """Phase at which what a beat [1/sample] adds looks most like what the error needs."""
    which = (beat * np.arange(ages.gain.shape[1]) % 1.0 * _AGES).astype(int) % _AGES
    gain, energy = (np.stack([np.bincount(which, of_age, _AGES) for of_age in signals])
                    for signals in ages)
    age = np.arange(_AGES)
    matched, squared = (np.array([signals[(age + shift) % _AGES, age].sum() for shift in age])
                        for signals in (gain, energy))
    least = _FLAT * squared.mean() + 1e-300
    return int(np.argmax(matched / np.sqrt(np.maximum(squared, least)))) / _AGES


def _with_best_phases(joint: DriveErrors, use: Use) -> Use:
    """Phases with which the logs are explained best, one after the other."""
    phases = np.array(use.values["phase"])
    responses = [_response(joint, use.values, j, phases[j]) for j in range(len(phases))]
    for j in range(len(phases)):
        for around in _PHASES_AROUND:
            tried = phases[j] + around
            moved = [_response(joint, use.values, j, phase) for phase in tried]
            best = int(np.argmax([_drop_with(joint, responses, j, one) for one in moved]))
            phases[j], responses[j] = tried[best], moved[best]
    return _use(joint, {**use.values, "phase": phases % 1.0})


def _drop_with(joint: DriveErrors, responses: Sequence[np.ndarray], j: int, response: np.ndarray,
               ) -> float:
    """Drop of chi^2 with another response in log j; what no fit sees stands for itself."""
    if j not in joint.fitted:
        return float(2 * response @ joint.errors[j] - response @ response)
    return joint.drop_and_scale_of([response if i == j else responses[i]
                                    for i in joint.fitted])[0]


def _with_best_beat(joint: DriveErrors, use: Use) -> Use:
    """Beat that turns a little more or less over the longest log; half-way the phases stay."""
    middles = np.array([len(u) * joint.period / 2 for u in joint.u])
    for around in _BEATS_AROUND:
        beat, phases = use.values["beat"], use.values["phase"]
        use = max([use, *(_use(joint, {**use.values, "beat": beat + shift,
                                       "phase": (phases - shift * middles) % 1.0})
                          for shift in around / (2 * middles.max()))], key=drop_of)
    return use


def _with_best_spread(joint: DriveErrors, use: Use) -> Use:
    """Spread that explains most, where what it adds grows with it."""
    _, scale = _drop_and_scale(joint, use.values)
    spread = min(float(use.values["spread"] * np.clip(scale, *_SCALES)), OLDEST_COMMAND)
    return max(use, _use(joint, {**use.values, "spread": spread}), key=drop_of)


def _use(joint: DriveErrors, values: Values) -> Use:
    return Use(_drop_and_scale(joint, values)[0], values)


def _drop_and_scale(joint: DriveErrors, values: Values) -> tuple[float, float]:
    phases = np.asarray(values["phase"])
    return joint.drop_and_scale_of([_response(joint, values, j, phases[j])
                                    for j in joint.fitted])


def _response(joint: DriveErrors, values: Values, j: int, phase: float) -> np.ndarray:
    """Whitened response in log j to what the age of the command adds, at a phase of its own."""
    u, turns = joint.u[j], values["beat"] * joint.period * np.arange(len(joint.u[j])) + phase
    added = _aged(u, values["spread"] / joint.period * (turns % 1.0)) - u
    return joint.columns(j, added[:, None])[:, 0]
