"""Errors of a joint beside its commands, in which faults of its drive are looked for."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.jacobian import joint_columns
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.events import torque_columns
from clie_blocks.analysis.gap.search.ripple_spectrum import needed_torque, sent_back
from clie_blocks.analysis.gap.search.screening import unexplained

_LINES = 6  # of a spectrum that are looked at
_AROUND = 101  # bins of a spectrum over which a line stands out
_PADDED = 4  # times the length of a log, of its transform


class Use(NamedTuple):
    """A fault at one joint: the drop of chi^2 that it explains, and its parameters."""

    drop: float
    values: dict[str, float | np.ndarray]


class DriveErrors(NamedTuple):
    """Errors of one joint beside its commands, one per log.

    They are also sent back to its torque: as products with the responses to it, and as the torque
    that would explain them.
    The basis spans what the parameters of the fit explain, of the fitted logs together, and the
    target is the error without it.
    """

    residuals: ResidualModel
    fit: Fit
    errors: list[np.ndarray]
    k: int
    u: list[np.ndarray]
    back: list[np.ndarray]
    torque: list[np.ndarray]
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
        return self.drop_and_scale_of([self.columns(j, torque[:, None])[:, 0]
                                       for j, torque in zip(self.fitted, torques)])[0]

    def drop_and_scale_of(self, responses: Sequence[np.ndarray]) -> tuple[float, float]:
        """Drop of chi^2 by whitened responses (N,), one per fitted log, and the best factor."""
        column = unexplained(np.concatenate(responses), self.basis)
        product, energy = float(column @ self.target), float(column @ column)
        return 2 * product - energy, product / energy if energy > 0.0 else 1.0


def drive_errors(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                 joints: Iterable[int]) -> dict[int, DriveErrors]:
    """Return the errors of a fit at some joints, beside their commands."""
    problem, (fitted, targets), by_joint = residuals.problem, joint_columns(fit, residuals), {}
    for k in joints:
        basis, of_joint = np.linalg.qr(fitted[k])[0], [of_log[k] for of_log in errors]
        back = [sent_back(residuals, fit, error, j, k) for j, error in enumerate(of_joint)]
        torque = [needed_torque(residuals, fit, error, j, k) for j, error in enumerate(of_joint)]
        by_joint[k] = DriveErrors(
            residuals, fit, of_joint, k, [log.u[:, k] for log in problem.logs], back, torque,
            basis, unexplained(targets[k], basis))
    return by_joint


def power_of(signals: Sequence[np.ndarray], period: float, highest: float,
             ) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz], up to a highest one at least, and the power of some signals.

    They are averaged over as many samples as that frequency allows: it is most of the time.
    """
    width = max(1, int(1.0 / (2.0 * highest * period)))
    slow = [signal[:len(signal) // width * width].reshape(-1, width).mean(axis=1)
            for signal in signals]
    size = 1 << (_PADDED * max(map(len, slow)) - 1).bit_length()
    power = np.sum([np.abs(np.fft.rfft(signal - signal.mean(), size)) ** 2
                    for signal in slow], axis=0)
    return np.fft.rfftfreq(size, width * period), power


def outstanding(frequency: np.ndarray, power: np.ndarray, lowest: float, highest: float,
                 count: int = _LINES) -> list[float]:
    """Return the frequencies of the lines that stand out most from their neighbours."""
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


def drop_of(use: Use) -> float:
    """Drop of chi^2 by a fault."""
    return use.drop
