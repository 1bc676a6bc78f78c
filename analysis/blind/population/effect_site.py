"""Where a hidden effect is drawn, and how it changes the true parameters with its size."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.population.maker import Run

SMOOTHED = 0.04  # s, over which a measured speed is averaged
Change = Callable[[float], dict[str, np.ndarray]]  # size to changed parameters, each of shape (n,)


@dataclass(frozen=True, eq=False)
class HiddenEffect:
    """A drawn effect; its joints are counted from 1, and empty for the robot as a whole."""

    name: str
    joints: tuple[int, ...]
    change: Change

    def apply(self, truth: dict[str, np.ndarray], size: float) -> dict[str, np.ndarray]:
        """True parameters with the effect at a size."""
        return {**truth, **self.change(size)}


@dataclass(frozen=True, eq=False)
class Site:
    """Where an effect is drawn.

    Parameters
    ----------
    robot : DrawnRobot
        The robot.
    truth : dict
        Its parameters without the effect.
    runs : list of (q, u)
        What it does without the effect.
    joint : int
        Joint that is affected, counted from 0.

    """

    robot: DrawnRobot
    truth: dict[str, np.ndarray]
    runs: list[Run]
    joint: int

    @property
    def torque(self) -> np.ndarray:
        """Torque that shifts a joint by a milliradian, shape (n,) [N m, motor side]."""
        return 1e-3 * self.robot.kp

    @property
    def largest_command(self) -> np.ndarray:
        """Largest command without the effect, shape (n,) [N m]."""
        return np.max([np.abs(u).max(axis=0) for _, u in self.runs], axis=0)

    @property
    def power(self) -> np.ndarray:
        """Mean square of the command without the effect, shape (n,) [(N m)^2]."""
        return np.mean([np.mean(u**2, axis=0) for _, u in self.runs], axis=0)

    @property
    def farthest(self) -> np.ndarray:
        """Largest angle without the effect, shape (n,) [rad]."""
        return np.max([q.max(axis=0) for q, _ in self.runs], axis=0)

    def steepest_envelope(self, peak: np.ndarray) -> np.ndarray:
        """Droop at which ``peak (1 - droop |dq|)`` touches the command, shape (n,) [s/rad].

        The speed is the mean over `SMOOTHED`, because the measured angle is noisy.
        """
        width = round(SMOOTHED / self.robot.period)
        touched = np.full(self.robot.n, np.inf)
        for q, u in self.runs:
            speed = (q[width:] - q[:-width]) / (width * self.robot.period)
            torque = u[width // 2:][:len(speed)]
            drives = speed * torque > 0
            droop = (1 - np.abs(torque) / peak) / np.where(drives, np.abs(speed), np.nan)
            touched = np.fmin(touched, np.nanmin(np.where(drives, droop, np.inf), axis=0))
        return touched

    def at(self, key: str, value: np.ndarray | float) -> dict[str, np.ndarray]:
        """Parameter ``key`` with a value at the affected joint, else as it was."""
        values = self.truth[key].copy()
        values[self.joint] = np.broadcast_to(value, values.shape)[self.joint]
        return {key: values}


Draw = Callable[[np.random.Generator, Site], Change]


def proportional(site: Site, key: str, unit: np.ndarray | float,
                  **fixed: np.ndarray | float) -> Change:
    """Change that grows in proportion to the size."""
    def change(size: float) -> dict[str, np.ndarray]:
        changed = site.at(key, size * np.asarray(unit))
        for other, value in fixed.items():
            changed |= site.at(other, value)
        return changed
    return change


def with_unit(key: str, unit: float) -> Draw:
    """Draw of a change that is the size times one unit."""
    return lambda rng, site: proportional(site, key, unit)
