"""How large an effect is: its trace in the closed-loop prediction of the refitted nominal model.

The refit is linear: the trace of the effect in q, less what changes of inertia, damping and
offset of every joint could have caused, relative to the noise floor of the sensor.
"""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run

FITTED = (0, 1)  # logs that the nominal model is fitted on; the third judges
MOVED = {"rotor": 0.01, "drag": 0.05, "offset": 0.002}  # relative; offset in kp


@dataclass(frozen=True, eq=False)
class Reference:
    """The healthy robot in its three experiments, and how its numbers move it.

    Parameters
    ----------
    runs : list of (q, u)
        Per log.
    columns : list of ndarray, shape (N n, 3 n)
        Change of q per log by each number, weighted by the noise floor.

    """

    runs: list
    columns: list


def reference(robot, truth, motions, noises):
    """Run the healthy robot, and with each of its numbers moved a little.

    Parameters
    ----------
    robot : Robot
        As stated.
    truth : dict
        Its true numbers.
    motions : list of Motion
        The experiments.
    noises : list of ndarray
        Sensor noise.

    """
    apart = robot.kind == "axes" or not truth["links"].any()
    groups = [range(robot.n)] if apart else [[k] for k in range(robot.n)]
    moved = [_moved(robot, truth, key, joints) for key in MOVED for joints in groups]
    lanes = [lane for lane in [truth, *moved] for _ in motions]
    copies = len(moved) + 1
    found = run(robot, lanes, motions * copies, noises * copies)
    count = len(motions)
    runs = found[:count]
    changes = [[found[count * c + j][0] - runs[j][0] for c in range(1, copies)]
               for j in range(count)]
    if apart:  # each joint answers for itself
        changes = [[change * (np.arange(robot.n) == k) for change in log for k in range(robot.n)]
                   for log in changes]
    return Reference(runs, [np.stack([_weighted(robot, change) for change in log], axis=1)
                            for log in changes])


def _moved(robot, truth, key, joints):
    other = truth[key].copy()
    for k in joints:
        other[k] += MOVED[key] * (robot.kp[k] if key == "offset" else other[k])
    return {**truth, key: other}


def prediction(robot, ref, runs):
    """Prediction error of the refitted nominal model, relative to the noise floor.

    Parameters
    ----------
    robot : Robot
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
    traces = [_weighted(robot, run[0] - base[0]) for run, base in zip(runs, ref.runs)]
    matrix = np.concatenate([ref.columns[j] for j in FITTED])
    target = np.concatenate([traces[j] for j in FITTED])
    change = np.linalg.lstsq(matrix, target, rcond=None)[0]
    left = [(trace - column @ change).reshape(-1, robot.n)
            for trace, column in zip(traces, ref.columns)]
    return np.sqrt(1 + np.array([np.mean(part**2, axis=0) for part in left]))


def ratio_of(prediction_errors):
    """One figure for the size: pooled over the fitted logs, at the joint that shows it most."""
    return float(np.sqrt(np.mean(prediction_errors[list(FITTED)] ** 2, axis=0)).max())


def _weighted(robot, q):
    return (q / robot.floor).ravel()
