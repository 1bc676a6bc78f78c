"""How large an effect is: its trace in the closed-loop prediction of the refitted nominal model.

The refit is linear: the trace of the effect in q, less what changes of inertia, damping and
offset of every joint could have caused, relative to the noise floor of the sensor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.population.maker import Run

FITTED = (0, 1)  # logs that the nominal model is fitted on; the third is the hold-out
PERTURBATIONS = {"rotor": 0.01, "drag": 0.05, "offset": 0.002}  # relative; offset in kp


@dataclass(frozen=True, eq=False)
class Reference:
    """The healthy robot in its three experiments, and its sensitivity to its parameters.

    Parameters
    ----------
    runs : list of (q, u)
        Per log.
    columns : list of ndarray, shape (N n, 3 n)
        Change of q per log by each parameter, in units of the noise floor.

    """

    runs: list[Run]
    columns: list[np.ndarray]


def reference(robot: DrawnRobot, truth: dict[str, np.ndarray], experiments: list[Experiment],
              noises: list[np.ndarray]) -> Reference:
    """Run the healthy robot, and again with each of its parameters perturbed."""
    apart = robot.kind == "axes" or not truth["links"].any()
    groups = [list(range(robot.n))] if apart else [[k] for k in range(robot.n)]
    perturbed = [_perturb(robot, truth, key, joints) for key in PERTURBATIONS for joints in groups]
    lanes = [lane for lane in [truth, *perturbed] for _ in experiments]
    copies = len(perturbed) + 1
    logs = run(robot, lanes, experiments * copies, noises * copies)
    count = len(experiments)
    runs = logs[:count]
    changes = [[logs[count * c + j][0] - runs[j][0] for c in range(1, copies)]
               for j in range(count)]
    if apart:  # all joints were perturbed at once, and do not affect each other
        changes = [[change * (np.arange(robot.n) == k) for change in log for k in range(robot.n)]
                   for log in changes]
    return Reference(runs, [np.stack([_in_noise_units(robot, change) for change in log], axis=1)
                            for log in changes])


def _perturb(robot: DrawnRobot, truth: dict[str, np.ndarray], key: str,
             joints: list[int]) -> dict[str, np.ndarray]:
    other = truth[key].copy()
    for k in joints:
        other[k] += PERTURBATIONS[key] * (robot.kp[k] if key == "offset" else other[k])
    return {**truth, key: other}


def relative_prediction_error(robot: DrawnRobot, ref: Reference,
                              runs: Sequence[Run]) -> np.ndarray:
    """Prediction error of the refitted nominal model, relative to the noise floor.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    ref : Reference
        The healthy robot.
    runs : list of (q, u)
        The robot with its effect.

    Returns
    -------
    ndarray, shape (logs, n)
        RMS per log and joint; 1 where there is noise alone.

    """
    traces = [_in_noise_units(robot, log[0] - base[0]) for log, base in zip(runs, ref.runs)]
    matrix = np.concatenate([ref.columns[j] for j in FITTED])
    target = np.concatenate([traces[j] for j in FITTED])
    change = np.linalg.lstsq(matrix, target, rcond=None)[0]
    residuals = [(trace - column @ change).reshape(-1, robot.n)
                 for trace, column in zip(traces, ref.columns)]
    return np.sqrt(1 + np.array([np.mean(residual**2, axis=0) for residual in residuals]))


def size_ratio(prediction_errors: np.ndarray) -> float:
    """One figure for the size: pooled over the fitted logs, at the joint that shows it most."""
    return float(np.sqrt(np.mean(prediction_errors[list(FITTED)] ** 2, axis=0)).max())


def _in_noise_units(robot: DrawnRobot, q: np.ndarray) -> np.ndarray:
    return (q / robot.floor).ravel()
