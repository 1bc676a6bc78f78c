"""How large an effect is: its trace in the closed-loop prediction of the refitted nominal model.

The refit is linear: the trace of the effect in q, less what changes of inertia, damping and
offset of every joint could have caused, relative to the noise floor of the sensor.  Shares of
several effects are those of the gap that a diagnosis reports: its nominal model is refitted as far
as the tolerances of the robot file go, with the masses of links where these have one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.engine.spatial_links import MASS_TOLERANCE
from clie_blocks.analysis.blind.population.maker import Run

FITTED = (0, 1)  # logs that the nominal model is fitted on; the third is the hold-out
PERTURBATIONS = {"rotor": 0.01, "drag": 0.05, "offset": 0.002}  # relative; offset in kp
COUNTED = 100.0  # errors per second that count beside a tolerance
TOLERANCES = {"rotor": 0.01, "drag": 0.15, "offset": 0.01, "heavier": MASS_TOLERANCE}  # as above


@dataclass(frozen=True, eq=False)
class Reference:
    """The healthy robot in its three experiments, and its sensitivity to its parameters.

    Parameters
    ----------
    runs : list of (q, u)
        Per log.
    columns : list of ndarray, shape (N n, 3 n)
        Change of q per log by each parameter, in units of the noise floor.
    price : float
        What a change of a parameter by one costs a refit, in the same units; 0 where any is free.

    """

    runs: list[Run]
    columns: list[np.ndarray]
    price: float = 0.0


def reference(robot: DrawnRobot, truth: dict[str, np.ndarray], experiments: list[Experiment],
              noises: list[np.ndarray], within_tolerances: bool = False) -> Reference:
    """Run the healthy robot, and again with each of its parameters perturbed.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    truth : dict
        Its parameters without effects.
    experiments, noises : list
        Its motions, and the noise of its encoders in each.
    within_tolerances : bool
        Whether a refit keeps to the robot file: a tolerance costs as much as an error of one.

    """
    apart = robot.kind == "axes" or not truth["links"].any()
    groups = [list(range(robot.n))] if apart else [[k] for k in range(robot.n)]
    steps = dict(TOLERANCES) if within_tolerances else dict(PERTURBATIONS)
    if robot.links is None:
        steps.pop("heavier", None)
    perturbed = [_perturb(robot, truth, key, step, joints) for key, step in steps.items()
                 for joints in groups]
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
                            for log in changes],
                     (robot.period * COUNTED) ** -0.5 if within_tolerances else 0.0)


def _perturb(robot: DrawnRobot, truth: dict[str, np.ndarray], key: str, step: float,
             joints: list[int]) -> dict[str, np.ndarray]:
    other = truth[key].copy()
    scale = {"offset": robot.kp, "heavier": np.ones(robot.n)}.get(key, other)
    for k in joints:
        other[k] += step * scale[k]
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
    if ref.price:
        matrix = np.concatenate([matrix, ref.price * np.eye(matrix.shape[1])])
        target = np.concatenate([target, np.zeros(matrix.shape[1])])
    change = np.linalg.lstsq(matrix, target, rcond=None)[0]
    residuals = [(trace - column @ change).reshape(-1, robot.n)
                 for trace, column in zip(traces, ref.columns)]
    return np.sqrt(1 + np.array([np.mean(residual**2, axis=0) for residual in residuals]))


def size_ratio(prediction_errors: np.ndarray) -> float:
    """One figure for the size: pooled over the fitted logs, at the joint that shows it most."""
    return float(np.sqrt(np.mean(prediction_errors[list(FITTED)] ** 2, axis=0)).max())


def _in_noise_units(robot: DrawnRobot, q: np.ndarray) -> np.ndarray:
    return (q / robot.floor).ravel()
