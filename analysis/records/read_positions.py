"""Positions that a controller read, from its commands: a log may hold noise of its own.

A logger may read another sensor than the controller, or over a worse line.  Such noise in the
logged position alone never passed through the law, so that the law, replayed on the log, does not
give the logged commands.  But a PD law can be inverted: its commands tell which position it read.

    u = kp (q_d - q) - kd F(z) q + pe   =>   q = (kp q_d + pe - u) / (kp + kd F(z))

If this law ran, that position and the logged one differ by the noise of the log alone, which is
white.  If another law ran they differ by what follows the motion, of which most is tested for by
name: other gains, other corners of the velocity filter, an integral part.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.records.control_law import ControlLaw, control_law
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import is_in_step, sample_time
from clie_blocks.linear_filters import lfilter

BLOCKS = (10, 100)  # samples whose means show noise that is not white
UNLIKELY = 5.0  # standard deviations, by which a mean square differs from that of white noise
LEAST_BLOCKS = 20  # of a log whose noise is judged
MOST_CHI2 = 40.0  # that a handful of directions take up of white noise: by chance once in 10^7
ABOVE_STEPS = 2.0  # times the noise of rounded positions and commands: less needs no correction
SEEN_IN_LOG = 1.2  # times the noise of the logged position, of which the noise is a part
THIRD_DIFFERENCE = np.sqrt(20.0)  # standard deviation of one of white noise
FAR = 1e3  # standard deviations of noise: the error of a law that cannot be inverted
JUDGED = 100_000  # samples of each log, at most, from which its noise is judged
AFTER_END = 1000  # samples that a signal is taken to stay where it ends
NEAR_CIRCLE = 1e-4  # distance of a root of the law from the unit circle: closer never settles
SMALL = 1e-3  # relative change of a number of the law, for a derivative
NEAR_CORNERS = ((0.0, 0.0), (-0.7, -0.7), (0.7, 0.7))  # logarithms, where fits of corners begin


@dataclasses.dataclass(frozen=True, eq=False)
class ReadPositions:
    """Positions that the controller of one joint read.

    Parameters
    ----------
    q : list of ndarray
        The positions in each log, shape (N,) [unit of q].
    noise : float
        Standard deviation of what the logs hold beside them [unit of q].
    corners : tuple of float or None
        Corners of the velocity filter, where others than the stated ones ran [rad/s].

    """

    q: list[np.ndarray]
    noise: float
    corners: tuple[float, float] | None = None


def read_positions(records: Sequence[Record], controller: Controller, k: int,
                   ) -> ReadPositions | None:
    """Positions that the controller of joint k read, where the logs prove that they hold noise.

    It is None where the logged position is as good as that, or where neither the stated law nor
    one with other corners leaves noise alone.
    """
    if not all(_can_be_inverted(record, controller, k) for record in records):
        return None
    law = control_law(controller, sample_time(records[0], controller))
    heads = [record.part(0, min(len(record), JUDGED)) for record in records]
    noise = _noise_alone(heads, law, k)
    corners = None
    if noise is None:
        found = _other_corners(heads, law, k)
        if found is None:
            return None
        law, corners = _with_corners(law, k, found), found
        noise = _noise_alone(heads, law, k)
    read = _positions(records, law, k)
    return None if noise is None or read is None else ReadPositions(read, noise, corners)


def _noise_alone(records: Sequence[Record], law: ControlLaw, k: int) -> float | None:
    """Standard deviation of the noise of the logs, if a law leaves nothing else of them."""
    read = _positions(records, law, k)
    if read is None:
        return None
    noise = _noise(records, k, read)
    alone = _stands_out(records, law, k, noise) and _hold_noise_alone(records, law, k, read)
    return noise if alone else None


def _can_be_inverted(record: Record, controller: Controller, k: int) -> bool:
    """Whether a log has each row of the law, and no command at its limit."""
    if record.u is None or record.qd is None or not is_in_step(record, controller):
        return False
    limit = np.inf if controller.saturation is None else controller.saturation[k]
    return bool(len(record.segments) == 1 and record.valid.all()
                and len(record) >= LEAST_BLOCKS * max(BLOCKS)
                and np.abs(record.u[:, k]).max() < limit)


class _Inverse(NamedTuple):
    """Filter from the commands of a law to the positions that it read.

    Where the velocity comes late, as of a held filter, the inverse has a part that is stable only
    against time; a log holds what comes later.

    Parameters
    ----------
    numerator, denominator : ndarray
        Of the part that runs with time, in powers of 1/z.
    backward : ndarray
        Denominator of the part that runs against time, in powers of z.
    gain : float
        Of that part.

    """

    numerator: np.ndarray
    denominator: np.ndarray
    backward: np.ndarray
    gain: float

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Filtered signal (N,), as if it stayed where it ends."""
        ahead = len(self.backward) - 1
        padded = np.pad(x, (0, AFTER_END), mode="edge")
        against = lfilter([1.0 / self.gain], self.backward, padded[::-1])[::-1]
        return np.asarray(lfilter(self.numerator, self.denominator,
                                  against[ahead:])[:len(x)])


def _inverse(law: ControlLaw, k: int) -> _Inverse | None:
    """Filter from commands to positions of joint k, if there is a stable one."""
    kp, b, a = law.kp[k], law.numerator[:, k], law.denominator[:, k]
    forward = kp * a + law.kd[k] * b
    if kp <= 0 or forward[0] == 0:
        return None
    roots = np.roots(forward)
    size = np.abs(roots)
    if (np.abs(size - 1.0) < NEAR_CIRCLE).any():
        return None
    inside, outside = roots[size < 1.0], roots[size > 1.0]
    return _Inverse(a, forward[0] * _polynomial(inside), _polynomial(1.0 / outside),
                    float(np.real(np.prod(-outside))))


def _polynomial(roots: np.ndarray) -> np.ndarray:
    """Coefficients of the polynomial with some roots, of which complex ones are pairs."""
    return np.atleast_1d(np.real(np.poly(roots)))


def _positions(records: Sequence[Record], law: ControlLaw, k: int) -> list[np.ndarray] | None:
    """Positions that the law read at joint k; None where it cannot be inverted."""
    inverse = _inverse(law, k)
    return None if inverse is None else [_position(record, law, k, inverse) for record in records]


def _position(record: Record, law: ControlLaw, k: int, inverse: _Inverse) -> np.ndarray:
    """Position that the law read, its velocity filter at rest at the first one."""
    reference = record.signal("qd")[:, k]
    feedback = record.signal("u")[:, k] - (0.0 if record.pe is None else record.pe[:, k])
    first = reference[0] - feedback[0] / law.kp[k]
    return first + inverse(law.kp[k] * (reference - first) - feedback)


def _noise(records: Sequence[Record], k: int, read: Sequence[np.ndarray]) -> float:
    """Standard deviation of white noise between the positions that were logged and read."""
    return float(np.sqrt(np.mean([_white_square(q - record.q[:, k])
                                  for q, record in zip(read, records, strict=True)])))


def _white_square(x: np.ndarray) -> float:
    """Mean square of white noise, from its steps, in which no slow part counts."""
    return float(np.mean(np.diff(x) ** 2)) / 2


def _stands_out(records: Sequence[Record], law: ControlLaw, k: int, noise: float) -> bool:
    """Whether a noise is more than what rounding leaves, and no more than the log shows."""
    robot = records[0].robot
    stated = None if robot is None else robot.encoder.resolution
    step = np.hypot(law.resolution[k] / law.kp[k], 0.0 if stated is None else stated[k])
    logged = np.sqrt(np.mean([np.mean(np.diff(record.q[:, k], 3) ** 2) for record in records]))
    return bool(ABOVE_STEPS * step / np.sqrt(12.0) < noise
                < SEEN_IN_LOG * logged / THIRD_DIFFERENCE)


def _hold_noise_alone(records: Sequence[Record], law: ControlLaw, k: int,
                      read: Sequence[np.ndarray]) -> bool:
    """Whether the logged positions differ from those that were read by white noise alone."""
    return all(_is_white(q - record.q[:, k]) and _is_apart(q - record.q[:, k], record, law, k)
               for q, record in zip(read, records, strict=True))


def _is_white(x: np.ndarray) -> bool:
    """Whether means over some samples are as small as those of white noise."""
    square = _white_square(x)
    for width in BLOCKS:
        count = len(x) // width
        means = x[:count * width].reshape(count, width).mean(axis=1)
        ratio = width * np.mean(means**2) / square
        if abs(ratio - 1.0) > UNLIKELY * np.sqrt(2.0 / count):
            return False
    return True


def _is_apart(x: np.ndarray, record: Record, law: ControlLaw, k: int) -> bool:
    """Whether noise holds no more of what another law would leave than by chance."""
    columns = np.linalg.qr(_directions(record, law, k))[0]
    return bool(np.sum((columns.T @ x) ** 2) < MOST_CHI2 * _white_square(x))


def _directions(record: Record, law: ControlLaw, k: int) -> np.ndarray:
    """What small changes of the law make of the position that it read, shape (N, m)."""
    inverse = _inverse(law, k)
    if inverse is None:
        return np.zeros((len(record), 0))
    here = _position(record, law, k, inverse)
    error = record.signal("qd")[:, k] - record.q[:, k]
    columns = [inverse(law.period * np.cumsum(error))]
    others = ((changed, _inverse(changed, k)) for changed in _neighbours(law, k))
    columns += [_position(record, changed, k, other) - here
                for changed, other in others if other is not None]
    sizes = np.array([np.linalg.norm(column) for column in columns])
    return np.stack([column / size for column, size in zip(columns, sizes, strict=True)
                     if size > 0.0], axis=1)


def _neighbours(law: ControlLaw, k: int) -> list[ControlLaw]:
    """Laws that differ a little in a gain, or in a corner, at joint k."""
    more = 1.0 + SMALL * (np.arange(len(law.kp)) == k)
    gains = [dataclasses.replace(law, kp=law.kp * more),
             dataclasses.replace(law, kd=law.kd * more)]
    if law.corners is None:
        return gains
    high, low = law.corners
    return [*gains, *(_with_corners(law, k, corners)
                      for corners in ((high * (1 + SMALL), low), (high, low * (1 + SMALL))))]


def _with_corners(law: ControlLaw, k: int, corners: tuple[float, float]) -> ControlLaw:
    changed = law.with_filter(slice(k, k + 1), law.variant, corners)
    return dataclasses.replace(changed, corners=corners)


def _other_corners(records: Sequence[Record], law: ControlLaw, k: int,
                   ) -> tuple[float, float] | None:
    """Corners of the velocity filter that leave least of the logged positions."""
    read = _positions(records, law, k)
    if law.corners is None or read is None:
        return None
    noise = _noise(records, k, read)
    if not _stands_out(records, law, k, noise):
        return None
    from scipy.optimize import least_squares

    logged = np.concatenate([record.q[:, k] for record in records])

    def left(exponents: np.ndarray) -> np.ndarray:
        high, low = np.exp(exponents)
        read = _positions(records, _with_corners(law, k, (high, low)), k)
        return (np.concatenate(read) - logged) / noise if read else np.full(len(logged), FAR)

    starts = np.log(law.corners) + np.array(NEAR_CORNERS)
    fits = [least_squares(left, start, x_scale=0.1, max_nfev=40) for start in starts]
    high, low = np.sort(np.exp(min(fits, key=lambda fit: fit.cost).x))
    return float(high), float(low)
