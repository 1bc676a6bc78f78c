"""A multisine that excites the parameters as well as the limits on motion and torque allow."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, product

import control as ct
import numpy as np
from scipy.optimize import minimize

from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.errors import ClieError
from clie_blocks.excitation import multisine
from clie_blocks.joints import decoupled_joints

SAMPLES = 512  # over one common period


@dataclass(frozen=True)
class Limits:
    """Limits on the motion and torque of a joint.

    Parameters
    ----------
    position : float
        Largest deviation from the set-point [rad].
    velocity : float
        Largest speed [rad/s].
    torque : float
        Largest torque of the motor about its rest value [N m].

    """

    position: float
    velocity: float
    torque: float

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "torque"):
            if not getattr(self, name) > 0:
                raise ClieError(f"the {name} limit must be positive, got {getattr(self, name)}")


@dataclass(frozen=True)
class Multisine:
    """A designed excitation of one joint.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        Frequencies [Hz].
    amplitude : ndarray, shape (m,)
        Amplitudes [N m].
    phase : ndarray, shape (m,)
        Phases [rad].
    smallest : float
        Smallest eigenvalue of (28) per second of window, once settled.
    peaks : Limits
        Largest position, velocity and torque that it causes.

    """

    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    smallest: float
    peaks: Limits

    def __call__(self, t: float) -> np.ndarray:
        """Excitation [N m] at a time [s]."""
        return multisine(t, self.frequency, self.amplitude, self.phase)


def design_multisine(joints: ControlledJoints, joint: int, limits: Limits, *, period: float = 10.0,
                     lowest: float = 0.1, highest: float = 3.0, tones: int = 8) -> Multisine:
    """Multisine of one joint that maximises the smallest eigenvalue of (28) within limits.

    Pairs of harmonics of ``1/period`` are tried first; from the best pairs all amplitudes and
    phases are optimised.  The whole is scaled until a limit is reached: more of the same never
    excites less.

    Parameters
    ----------
    joints : ControlledJoints
        Robot (rough parameters are enough) and gains.
    joint : int
        Which joint, from 0.
    limits : Limits
        Limits on its motion and torque.
    period : float
        Common period of the tones [s]; the window of (28) is a multiple of it.
    lowest, highest : float
        Band of the tones [Hz].
    tones : int
        Most tones; neighbouring harmonics that coincide count once.

    Returns
    -------
    Multisine
        Tones without amplitude are left out.

    """
    harmonics = np.unique(np.round(np.geomspace(lowest, highest, tones) * period))
    frequency = harmonics[harmonics > 0] / period
    motion = _Motion(joints, joint, frequency, period)

    def worth(shape: np.ndarray) -> float:
        return -motion.smallest(motion.scaled(shape, limits))

    optima = [minimize(worth, start, method="Powell", options={"maxiter": 20, "xtol": 1e-3})
              for start in _starts(frequency.size, worth)]
    best = motion.scaled(min(optima, key=lambda one: one.fun).x, limits)
    used = np.abs(best) > 1e-3 * np.max(np.abs(best))
    best = np.where(used, best, 0)
    return Multisine(frequency[used], np.abs(best[used]), np.angle(best[used]),
                     motion.smallest(best), Limits(*motion.peaks(best)))


def _starts(m: int, worth: Callable[[np.ndarray], float], keep: int = 3) -> list[np.ndarray]:
    """The best pairs of tones, over a few ratios and phases: amplitudes, then phases."""
    pairs = []
    for first, second in combinations(range(m), 2):
        for ratio, phase in product((0.2, 0.5, 1.0, 2.0, 5.0), (0.0, np.pi / 2)):
            start = np.full(2 * m, 0.0)
            start[[first, second, m + second]] = 1.0, ratio, phase
            pairs.append(start)
    return sorted(pairs, key=worth)[:keep]


class _Motion:
    """Steady motion of one joint under a multisine, linear in its amplitudes."""

    def __init__(self, joints: ControlledJoints, joint: int, frequency: np.ndarray, period: float,
                 ) -> None:
        plant = decoupled_joints(joints.a, joints.b, joints.d)
        diagram = joint_loop(plant, joints.kp, joints.kd)
        system = ct.linearize(diagram, 0, 0)
        pe = diagram.input_labels.index(f"pe[{joint}]")
        rows = [diagram.output_labels.index(f"{name}[{joint}]") for name in ("q", "dq", "u")]
        response = system(2j * np.pi * frequency)[rows, pe, :]
        _, self.dq, self.u = response
        time = np.arange(SAMPLES) / SAMPLES * period
        tones = np.exp(2j * np.pi * np.outer(frequency, time))
        waves = (response[:, :, None] * tones).transpose(1, 0, 2).reshape(frequency.size, -1)
        self.waves = np.vstack((waves.imag, waves.real))  # by real and imaginary amplitudes
        self.rest = joints.d[joint] / joints.b[joint]

    def scaled(self, shape: np.ndarray, limits: Limits) -> np.ndarray:
        """Complex amplitudes of the given shape (shares, phases), as large as limits allow."""
        share, phase = shape.reshape(2, -1)
        amplitude = share * np.exp(1j * phase)
        bounds = (limits.position, limits.velocity, limits.torque)
        reached = np.maximum(self.peaks(amplitude), 1e-12)
        return amplitude * np.min(bounds / reached)

    def peaks(self, amplitude: np.ndarray) -> tuple[float, float, float]:
        """Largest position, velocity and torque."""
        motion = np.concatenate((amplitude.real, amplitude.imag)) @ self.waves
        q, dq, u = np.max(np.abs(motion).reshape(3, SAMPLES), axis=1).tolist()
        return q, dq, u

    def smallest(self, amplitude: np.ndarray) -> float:
        """Smallest eigenvalue of the mean of ``Phi Phi^T`` of this joint.

        The mean over a period is a sum over the tones, which are harmonics of it.
        """
        dq, u, rest = amplitude * self.dq, amplitude * self.u, self.rest
        power, work, effort = (np.vdot(*pair).real / 2 for pair in ((dq, dq), (dq, u), (u, u)))
        gramian = [[power, -work, 0], [-work, rest**2 + effort, -rest], [0, -rest, 1]]
        return float(np.linalg.eigvalsh(gramian)[0])
