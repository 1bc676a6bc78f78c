"""Faults of a drive that the logged commands place: steps, a clock that beats, lost packets.

The torque that such a fault adds is a function of the logged command and of a few numbers.  Its
product with the error, sent back through the filters of the loop, is what it would explain: one
transform tries every beat, one sum every stretch that a command may have been held.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.drive import PACKET_HOLD, TICK_JITTER, TORQUE_QUANTIZATION
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, Values
from clie_blocks.analysis.gap.fitting.jacobian import joint_columns
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.events import Found, torque_columns
from clie_blocks.analysis.gap.search.ripple_spectrum import sent_back
from clie_blocks.analysis.gap.search.screening import unexplained
from clie_blocks.measurement import quantized

_CHORD = 4  # samples over which the slope of a command is taken
_BEATS = 0.2, 40.0  # Hz: slower ones do not come back in a log, faster ones the loop averages
_LINES = 6  # of a spectrum that are looked at
_LINES_OF_HOLD = 3  # of each length
_REFINED_HOLDS = 6  # lengths and intervals, those that explain most as they are
_AROUND = 101  # bins of a spectrum over which a line stands out
_PADDED = 4  # times the length of a log, of its transform
_HOLDS = 3, 8, 20, 45, 100  # samples
_INTERVALS = 0.05, 5.0  # s
_HARMONICS = 8
_FLAT = 1e-6  # of the most energy that holding a command adds: less is rounding
_SKIPPED = 4  # of so many samples one tells which steps are worth a closer look
_FINEST, _COARSEST = 0.005, 0.2  # steps, over the largest command
_SHIFT = 0.15  # of a step, that the next one tried shifts


class Use(NamedTuple):
    """A fault at one joint: the drop of chi^2 that it explains, and its parameters."""

    drop: float
    values: dict[str, float | np.ndarray]


class _Joint(NamedTuple):
    """Errors of one joint, sent back to its torque, beside its commands; one per log.

    The basis spans what the parameters of the fit explain, of the fitted logs together, and the
    target is the error without it.
    """

    residuals: ResidualModel
    fit: Fit
    errors: list[np.ndarray]
    k: int
    u: list[np.ndarray]
    back: list[np.ndarray]
    basis: np.ndarray
    target: np.ndarray

    @property
    def fitted(self) -> range:
        """Logs that are fitted."""
        return range(len(self.residuals.problem.fit))

    @property
    def least(self) -> float:
        """Drop of chi^2 from which a fault is worth refining."""
        share = self.residuals.method.search.refined_share
        return share * float(self.target @ self.target)

    @property
    def period(self) -> float:
        """Sample time [s]."""
        return self.residuals.problem.period

    def columns(self, j: int, torque: np.ndarray) -> np.ndarray:
        """Whitened response in log j to torques (N, m) that the drive adds."""
        return -torque_columns(self.residuals, self.fit, j, self.k, torque)

    def drop(self, torques: Sequence[np.ndarray]) -> float:
        """Drop of chi^2 by torques (N,) that the drive adds, one per fitted log."""
        column = np.concatenate([self.columns(j, torque[:, None])[:, 0]
                                 for j, torque in zip(self.fitted, torques)])
        column = unexplained(column, self.basis)
        return float(2 * column @ self.target - column @ column)


def drive_fault_candidates(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                           causes: Sequence[Cause]) -> Found:
    """Return clocks that beat, held commands and torques in steps, and what they would explain."""
    searches = [(cause, best) for cause, best in _SEARCHES if cause in causes]
    joints = _joints(residuals, fit, errors) if searches else []
    found = Found()
    for cause, best in searches:
        uses = [best(joint) for joint in joints]
        values = {name: np.stack([np.asarray(use.values[name], float) for use in uses], axis=-1)
                  for name in uses[0].values}
        found.append((Member(cause, tuple(range(len(joints))), values, _sizes(values)),
                      np.array([use.drop for use in uses])))
    return found


def _joints(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]]) -> list[_Joint]:
    problem, (fitted, targets) = residuals.problem, joint_columns(fit, residuals)
    joints = []
    for k in range(problem.n):
        basis, of_joint = np.linalg.qr(fitted[k])[0], [of_log[k] for of_log in errors]
        back = [sent_back(residuals, fit, error, j, k) for j, error in enumerate(of_joint)]
        joints.append(_Joint(residuals, fit, of_joint, k, [log.u[:, k] for log in problem.logs],
                             back, basis, unexplained(targets[k], basis)))
    return joints


def _sizes(values: Values) -> Values:
    sizes = {name: np.abs(value) + 1e-9 for name, value in values.items()}
    small = {"beat": 0.01, "phase": 0.02}  # Hz and turns that have a visible effect
    return {name: small[name] + 0.0 * size if name in small else size
            for name, size in sizes.items()}


def _best_beat(joint: _Joint) -> Use:
    """Beat that explains most, of the lines that stand out of slope times error."""
    chords = [np.concatenate([np.repeat(u[:1], _CHORD), u[:-_CHORD]]) - u for u in joint.u]
    products = [joint.back[j] * chords[j] for j in joint.fitted]
    frequency, spectrum = _power(products, joint.period, 2 * _BEATS[1])
    lines = _outstanding(frequency, spectrum, *_BEATS)
    none = Use(0.0, {"spread": 0.0, "beat": 1.0, "phase": np.zeros(len(joint.u))})
    best = max((_beat(joint, chords, line) for line in lines), key=_drop, default=none)
    if best.drop <= joint.least:
        return best
    for shift in frequency[1] * np.array([0.5, 0.25, 0.125]):
        beat = float(best.values["beat"])
        best = max([best, *(_beat(joint, chords, beat + side * shift) for side in (-1, 1))],
                   key=_drop)
    return best


def _power(signals: Sequence[np.ndarray], period: float, highest: float,
           ) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz], up to a highest one at least, and the power of some signals together.

    They are averaged over as many samples as that frequency allows: it is most of the time.
    """
    width = max(1, int(1.0 / (2.0 * highest * period)))
    slow = [signal[:len(signal) // width * width].reshape(-1, width).mean(axis=1)
            for signal in signals]
    size = 1 << (_PADDED * max(map(len, slow)) - 1).bit_length()
    power = np.sum([np.abs(np.fft.rfft(signal - signal.mean(), size)) ** 2
                    for signal in slow], axis=0)
    return np.fft.rfftfreq(size, width * period), power


def _outstanding(frequency: np.ndarray, power: np.ndarray, lowest: float, highest: float,
                 count: int = _LINES) -> list[float]:
    """Frequencies of the lines that stand out most from their neighbours."""
    inside = np.flatnonzero((frequency > lowest) & (frequency < highest))
    if len(inside) < _AROUND:
        return []
    smooth = np.convolve(power, np.ones(_AROUND) / _AROUND, "same")
    score = np.where(smooth > 0, power / np.where(smooth > 0, smooth, 1.0) * np.sqrt(power), 0.0)
    kept, found = np.zeros(len(power)), list[float]()
    kept[inside] = score[inside]
    for _ in range(count):
        best = int(np.argmax(kept))
        found.append(float(frequency[best]))
        kept[max(best - 2 * _PADDED, 0):best + 2 * _PADDED + 1] = 0.0
    return found


def _beat(joint: _Joint, chords: list[np.ndarray], beat: float) -> Use:
    """Saw-tooth of one beat, from its first harmonic: -1/pi sine of its phase."""
    drop, sizes, phases = 0.0, [], []
    for j, chord in enumerate(chords):
        turn = 2 * np.pi * beat * joint.period * np.arange(len(chord))
        columns = joint.columns(j, chord[:, None] * np.stack([np.sin(turn), np.cos(turn)], 1))
        sine, cosine = theta = np.linalg.lstsq(columns, joint.errors[j], rcond=None)[0]
        phases.append(np.arctan2(-cosine, -sine) / (2 * np.pi))
        if j in joint.fitted:
            drop += float(joint.errors[j] @ columns @ theta)
            sizes.append(np.hypot(sine, cosine))
    spread = np.pi * float(np.mean(sizes)) * _CHORD * joint.period
    return Use(drop, {"spread": min(spread, 0.05), "beat": beat, "phase": np.array(phases)})


def _best_hold(joint: _Joint) -> Use:
    """Length, interval and phases of stretches over which the command is held.

    A line of the spectrum may be a harmonic, so that the holds come less often, or be made of
    every second or third harmonic, so that they come more often.
    """
    none = Use(0.0, {"hold": 0.0, "interval": 1.0, "phase": np.zeros(len(joint.u))})
    found = []
    for length in _HOLDS:
        by_log = _stretches(joint, length)
        of_lines = [(_hold(joint, by_log, length, interval), interval)
                    for interval in _intervals(joint, by_log, length)]
        line, interval = max(of_lines, key=_drop_of_line, default=(none, 0.0))
        found += [line, *(_hold(joint, by_log, length, share * interval)
                          for share in (1 / 3, 1 / 2, 2, 3) if share * interval > 2 * length)]
    likely = sorted(found, key=_drop, reverse=True)[:_REFINED_HOLDS]
    if not likely or likely[0].drop <= joint.least:
        return likely[0] if likely and likely[0].drop > 0.0 else none
    best = max((_refined_hold(joint, use, 1.0) for use in likely), key=_drop)
    for step in (0.5, 0.25, 0.1):
        best = _refined_hold(joint, best, step)
    return best


def _refined_hold(joint: _Joint, best: Use, step: float) -> Use:
    """Holds of another length, or more or less often, that explain more; by a share of a hold."""
    finest = 1.0 / max(len(u) for u in joint.u)
    hold, interval = (float(best.values[name]) / joint.period for name in ("hold", "interval"))
    tried = []
    for share in (1 - 0.5 * step, 1.0, 1 + 0.5 * step):
        length = max(1, round(hold * share))
        by_log = _stretches(joint, length)
        tried += [_hold(joint, by_log, length, interval * (1 + shift))
                  for shift in step * hold * finest * np.arange(-4, 5)]
    return max([best, *tried], key=_drop)


class _Stretches(NamedTuple):
    """What holding a command for some samples adds, by first sample, in one log.

    Its product with the error, and its energy.
    """

    gain: np.ndarray
    energy: np.ndarray


def _stretches(joint: _Joint, length: int) -> list[_Stretches]:
    """Stretches of a length [samples] in each log."""
    return [_stretches_in_log(u, back, length) for u, back in zip(joint.u, joint.back)]


def _stretches_in_log(u: np.ndarray, back: np.ndarray, length: int) -> _Stretches:
    before = np.concatenate([[0.0], u[:-1]])[:len(u) - length]
    error, product, command, squared = (
        sums[length:-1] - sums[:-length - 1] for sums in (
            np.concatenate([[0.0], np.cumsum(x)]) for x in (back, back * u, u, u * u)))
    energy = length * before**2 - 2.0 * before * command + squared
    return _Stretches(before * error - product, np.maximum(energy, 0.0))


def _intervals(joint: _Joint, by_log: list[_Stretches], length: int) -> list[float]:
    """Intervals [samples] whose harmonics stand out together in the gains of a length."""
    length_of_log = max(len(joint.u[j]) for j in joint.fitted) * joint.period
    longest = min(_INTERVALS[1], 0.3 * length_of_log)
    shortest = max(_INTERVALS[0], 2 * length * joint.period)
    if shortest >= longest:
        return []
    frequency, power = _power([by_log[j].gain for j in joint.fitted], joint.period,
                              (_HARMONICS + 1) / shortest)
    bins = np.arange(1, len(power) // (_HARMONICS + 1))
    comb = np.zeros(len(power))
    comb[bins] = sum(power[m * bins] for m in range(1, _HARMONICS + 1))
    return [1.0 / (line * joint.period) for line in _outstanding(
        frequency, comb, 1.0 / longest, 1.0 / shortest, _LINES_OF_HOLD)]


def _hold(joint: _Joint, by_log: list[_Stretches], length: int, interval: float) -> Use:
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


def _best_step(joint: _Joint) -> Use:
    """Resolution at which the rounding of the logged command explains most of the error."""
    largest = max(np.abs(u).max() for u in joint.u)
    tried, step = [], _COARSEST * largest
    while step > _FINEST * largest:
        tried.append(step)
        step -= _SHIFT * step * step / largest
    gains = np.array([_rounding_gain(joint, step) for step in tried]) if tried else np.zeros(0)
    if not gains.size or not largest:
        return Use(0.0, {"resolution": 0.0})
    leading = np.argsort(gains / np.array(tried))[::-1][:_LINES]
    best = max((_step(joint, tried[i]) for i in leading), key=_drop)
    if best.drop <= joint.least:
        return best
    for share in (0.3, 0.1, 0.03, 0.01):
        step = float(best.values["resolution"])
        shifts = share * _SHIFT * step * step / largest * np.arange(-4, 5)
        best = max([best, *(_step(joint, step + shift) for shift in shifts)], key=_drop)
    return best


def _rounding_gain(joint: _Joint, step: float) -> float:
    few = slice(None, None, _SKIPPED)
    return float(sum(joint.back[j][few] @ (quantized(joint.u[j][few], step) - joint.u[j][few])
                     for j in joint.fitted))


def _step(joint: _Joint, step: float) -> Use:
    return Use(joint.drop([quantized(joint.u[j], step) - joint.u[j] for j in joint.fitted]),
               {"resolution": step})


def _drop(use: Use) -> float:
    return use.drop


def _drop_of_line(line: tuple[Use, float]) -> float:
    return line[0].drop


_SEARCHES = ((TICK_JITTER, _best_beat), (PACKET_HOLD, _best_hold),
             (TORQUE_QUANTIZATION, _best_step))
