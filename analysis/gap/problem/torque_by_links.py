"""Torque per command where nothing states it, with the links of the robot as the scale.

What coupling and weight of stated links take of the torque is known in N m, and what they take of
the command shows in the log: their ratio is the torque per command.  Whatever else a joint takes
of the command is fitted beside it:

    u = torque of the links / (r K) + J ddq + B dq + F sign(dq) + u_0
"""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.position_path import CORRELATION_TIME, block_influence
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks.measures import (
    centres,
    half_width,
    smooth_motion,
    triangular_mean,
)
from clie_blocks.robot_loop.links import Links, bias_torque, inertial_torque

CERTAIN = 0.2  # relative standard deviation, above which the logs do not show it
# Relative, of the torque that links show: a load that they carry beyond their model has its part.
TOLERANCE = 0.5
_ALIKE = 1e-6  # share of the torque of the links beyond the joint's own that is rounding
_OWN = 4  # parameters of a joint beside its torque per command


def torque_by_links(robot: Robot, records: Sequence[Record]) -> np.ndarray | None:
    """Torque at the motors per command [N m over the unit of u], shape (n,).

    None where the file states no links that couple or weigh, or the logs show it of no joint.
    Where links take next to nothing, as at the end of an arm, a joint is taken to be driven as the
    others are: there it hardly matters.

    Parameters
    ----------
    robot : Robot
        With links in kg and m.
    records : sequence of Record
        With commands, on even clocks.

    """
    links = stated_links(robot, records[0].q[0])
    turns = all(unit == "rad" for record in records for unit in record.units["q"])
    if not (turns and links.known and (links.has_coupling or links.has_gravity)):
        return None
    ratio = np.ones(robot.n) if robot.motor.gear_ratio is None else robot.motor.gear_ratio
    parts = [_motion(record, links, ratio) for record in records]
    width = round(CORRELATION_TIME / records[0].sample_time)
    torque = np.array([_of_joint([(own[k], u[:, k]) for own, u in parts], width)
                       for k in range(robot.n)])
    shown = np.isfinite(torque)
    return np.where(shown, torque, np.median(torque[shown])) if shown.any() else None


def _motion(record: Record, links: Links, ratio: np.ndarray,
            ) -> tuple[list[np.ndarray], np.ndarray]:
    """Regressors of each joint (samples, 1 + own), and commands (samples, n).

    The few rows that were filled in count, without which many a log would have no window.
    """
    width = half_width(record)
    at = centres(record.replace(valid=np.ones(len(record), bool)), width)
    q, dq, ddq = smooth_motion(record, at, width)
    torque = (inertial_torque(links, q, ddq) + bias_torque(links, q, dq)) / ratio
    one = np.ones(len(at))
    return ([np.stack([torque[:, k], ddq[:, k], dq[:, k], np.sign(dq[:, k]), one], axis=1)
             for k in range(record.n)], triangular_mean(record.signal("u"), at, width))


def _of_joint(parts: Sequence[tuple[np.ndarray, np.ndarray]], width: int) -> float:
    """Torque per command of one joint; NaN where its motion does not show it."""
    from scipy.optimize import lsq_linear

    regressors, u = map(np.concatenate, zip(*parts))
    if len(u) <= 10 * (1 + _OWN):
        return np.nan
    of_links, own = regressors[:, 0], np.linalg.qr(regressors[:, 1:])[0]
    beyond = of_links - own @ (own.T @ of_links)
    if np.linalg.norm(beyond) <= _ALIKE * np.linalg.norm(of_links):
        return np.nan
    least = np.array([0.0] * _OWN + [-np.inf])  # no torque, inertia or friction is negative
    fit = lsq_linear(regressors, u, (least, np.full(1 + _OWN, np.inf)))
    share = fit.x[0]
    deviation = np.linalg.norm(block_influence(beyond[:, None], fit.fun, width))
    return np.nan if deviation >= CERTAIN * share else float(1.0 / share)
