"""Regression of the equation of motion: the textbook's IDIM-LS, and instrumental variables."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.identification.columns import terms
from clie_blocks.analysis.identification.motion import Run
from clie_blocks.analysis.identification.signals_of_log import command
from clie_blocks.analysis.records.uncertainty import Fit, least_squares
from clie_blocks.errors import NotIdentifiableError


@dataclasses.dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters of one joint by one method, in units of the command.

    Parameters
    ----------
    method : str
        Which.
    names : tuple of str
        Terms of the model.
    value, interval : ndarray, shape (p,)
        Estimates and half widths of their 95 % intervals.
    note : str
        What to know about it.

    """

    method: str
    names: tuple[str, ...]
    value: np.ndarray
    interval: np.ndarray
    note: str = ""

    def get(self, name: str) -> tuple[float, float]:
        """Value and half width of a term."""
        position = self.names.index(name)
        return float(self.value[position]), float(self.interval[position])


def idim_least_squares(runs: Sequence[Run], loads: Sequence[np.ndarray], k: int,
                       names: tuple[str, ...]) -> Estimate:
    """IDIM-LS: ordinary least squares of the filtered command on the filtered measured motion.

    `loads` holds the known load torque of each run, shape (N, n).  The measured acceleration
    carries noise, and in closed loop the command carries the same noise; both bias the estimate
    of joint k (Janot, Vandanjon, Gautier 2014).  It is here as the reference.
    """
    speed = top_speed(runs, k)
    columns = [_filtered(run, terms(names, *_measured(run, k), speed), k) for run in runs]
    return _estimate("IDIM-LS", names, columns, _targets(runs, loads, k))


def instrumental_variables(runs: Sequence[Run], loads: Sequence[np.ndarray], k: int,
                           names: tuple[str, ...],
                           simulated: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
                           ) -> Estimate:
    """Instrumental variables: as IDIM-LS, correlated with the motion of a noise-free model.

    `simulated` holds position, velocity and acceleration of the closed-loop model over each run.
    Noise does not bias the estimate, as long as the model's loop is the robot's.
    """
    speed = top_speed(runs, k)
    columns = [_filtered(run, terms(names, *_measured(run, k), speed), k) for run in runs]
    instruments = [_filtered(run, terms(names, *motion, speed), k)
                   for run, motion in zip(runs, simulated, strict=True)]
    return _estimate("instrumental variables", names, columns, _targets(runs, loads, k),
                     instruments)


def top_speed(runs: Sequence[Run], k: int) -> float:
    """Largest filtered speed of a joint over all runs."""
    return max(float(np.abs(run.dq[run.inner, k]).max()) for run in runs)


def solve(columns: np.ndarray, target: np.ndarray, joint: str, names: Sequence[str],
          instruments: np.ndarray | None = None) -> Fit:
    """Least squares, with a message that names the combination when it has no answer.

    Raises
    ------
    NotIdentifiableError
        If the columns are not independent.

    """
    size = np.linalg.norm(columns, axis=0)
    if size.all():
        _, spread, directions = np.linalg.svd(columns / size, full_matrices=False)
        if spread[-1] > 1e-6 * spread[0]:
            return least_squares(columns, target, instruments)
        tied = [n for n, part in zip(names, directions[-1], strict=True) if abs(part) > 0.3]
    else:
        tied = [n for n, part in zip(names, size, strict=True) if part == 0]
    raise NotIdentifiableError(f"{joint}: {' and '.join(tied)} cannot be distinguished in this "
                               "motion; excite it more richly ('clie check' says how)")


def _measured(run: Run, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return run.q[:, k], run.dq[:, k], run.ddq[:, k]


def _filtered(run: Run, columns: np.ndarray, k: int) -> np.ndarray:
    return np.stack([run.lowpassed(column, k) for column in columns.T], axis=1)


def _targets(runs: Sequence[Run], loads: Sequence[np.ndarray], k: int) -> list[np.ndarray]:
    return [run.lowpassed(_acting(command(run.record)[:, k]) - load[:, k], k)
            for run, load in zip(runs, loads, strict=True)]


def _acting(u: np.ndarray) -> np.ndarray:
    """Torque around each sample: a held command acts for half a sample before it, too."""
    return (u + np.concatenate((u[:1], u[:-1]))) / 2


def _estimate(method: str, names: tuple[str, ...], columns: list[np.ndarray],
              targets: list[np.ndarray], instruments: list[np.ndarray] | None = None) -> Estimate:
    z = None if instruments is None else np.vstack(instruments)
    fit = solve(np.vstack(columns), np.concatenate(targets), method, names, z)
    return Estimate(method, names, fit.value, fit.interval)
