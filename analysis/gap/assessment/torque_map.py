"""What a model leaves and every lap repeats: a map of torque over position and speed.

Where a model leaves more than sensor noise, the rest may still be the same in every lap: friction
along a screw, a hard spot of a bearing, a friction curve that no law of the library describes.
Such a torque names no cause, but a simulator can hold it.  It is fitted with the model by least
squares through the sensitivity filter, with a ridge that parts of the fit logs choose, and
validated in closed loop on a log that was not fitted.

    torque against the motion = position+(q) + speed+(|dq|)  forward,
                                position-(q) + speed-(|dq|)  backward,     linear between knots
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.gap_reduction import reduction_percent
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.fitting.ridge import ridge_cv
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.residual.noise import rows_of
from clie_blocks.analysis.gap.residual.whitening import DIVERGED, ResidualModel
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.analysis.theory.sampled_loop import decimated_filter
from clie_blocks.linear_filters import lfilter

Curves = dict[str, Any]


@dataclasses.dataclass(frozen=True, eq=False)
class JointTorqueMap:
    """Torque map of one joint; a torque counts as positive against the motion.

    Parameters
    ----------
    joint : int
        Index.
    positions, speeds : ndarray
        Knots [rad, rad/s].
    over_position, over_speed : ndarray, shape (2, knots)
        Torque forward and backward [N m]; that over position has mean zero over the motion.
    position_spread, speed_spread : ndarray, shape (2, knots)
        Half widths of 95 % intervals, from maps that leave parts of the logs out [N m].
    reversal_speed : float
        Speed at which the joint turns from one direction to the other [rad/s].

    """

    joint: int
    positions: np.ndarray
    speeds: np.ndarray
    over_position: np.ndarray
    over_speed: np.ndarray
    position_spread: np.ndarray
    speed_spread: np.ndarray
    reversal_speed: float

    def load(self, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        """Torque that opposes, as at port ``load``, for a motion (N,) [N m]."""
        forward, backward = (
            np.interp(q, self.positions, position) + np.interp(np.abs(dq), self.speeds, speed)
            for position, speed in zip(self.over_position, self.over_speed))
        share = _forward(dq, self.reversal_speed)
        return share * forward - (1.0 - share) * backward


@dataclasses.dataclass(frozen=True, eq=False)
class TorqueMap:
    """Torque maps of the joints that leave a gap, and what they remove on unseen data.

    Parameters
    ----------
    joints : tuple of JointTorqueMap
        One per joint that leaves a gap.
    gap : float
        Gap of the corrected model with the maps, on the validation logs [rad].
    percent : float
        Share of the reducible gap of the model without them that they remove [%].
    interval : tuple of float or None
        Its 95 % interval.
    causes : tuple of str
        Causes that the model holds; none of them for the refitted nominal model.

    """

    joints: tuple[JointTorqueMap, ...]
    gap: float
    percent: float
    interval: tuple[float, float] | None
    causes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain types for the JSON answer; torques count as positive against the motion."""
        return {"percent": self.percent, "interval": self.interval, "gap": self.gap,
                "beside": list(self.causes),
                "unit": {"position": "rad", "speed": "rad/s", "torque": "N m"},
                "joints": [{"joint": joint.joint + 1,
                            "over_position": _curves(joint.positions, joint.over_position,
                                                     joint.position_spread),
                            "over_speed": _curves(joint.speeds, joint.over_speed,
                                                  joint.speed_spread)}
                           for joint in self.joints]}


def _curves(knots: np.ndarray, curves: np.ndarray, spread: np.ndarray) -> Curves:
    (forward, backward), (of_forward, of_backward) = curves, spread
    return {"at": knots, "forward": forward, "forward_half_width": of_forward,
            "backward": backward, "backward_half_width": of_backward}


def torque_map(hypothesis: Hypothesis, residuals: ResidualModel) -> TorqueMap | None:
    """Fit torque maps to what a model leaves; None where nothing is left or they do not pay.

    The model is the corrected one, or the refitted nominal one where no cause is believed.
    """
    problem, method = hypothesis.problem, residuals.method.assessment
    floors = np.array([noise.floor for noise in residuals.noises])
    if not problem.held_out or not problem.law.takes_excitation:
        return None
    errors = [hypothesis.error(j, dithered=False) for j in range(len(problem.logs))]
    validation = validation_logs(problem)
    left = np.sqrt(np.mean(np.concatenate([errors[j] for j in validation])**2, axis=0))
    joints = np.flatnonzero(left > method.map_least_gap * floors)
    if not joints.size or max(np.abs(error).max() for error in errors) >= DIVERGED:
        return None
    motions = [_motion(hypothesis, j) for j in range(len(problem.fit))]
    maps = tuple(_joint_map(hypothesis, motions, errors, int(k), method) for k in joints)
    with_maps = [corrected_error(hypothesis, maps, j, method.map_rounds) for j in validation]
    before = [np.sum(errors[j]**2, axis=1) for j in validation]
    after = [np.sum(error**2, axis=1) for error in with_maps]
    floor = float(np.sqrt(floors @ floors))
    percent, interval = reduction_percent(before, after, floor, problem.period, method)
    if (percent is None or percent < method.map_least_percent
            or (interval and interval[0] < 0.0)):
        return None
    return TorqueMap(maps, float(np.sqrt(np.mean(np.concatenate(after)))), percent, interval,
                     tuple(member.cause.name for member in hypothesis.members))


def corrected_error(hypothesis: Hypothesis, maps: Sequence[JointTorqueMap], j: int,
                    rounds: int = AssessmentMethod.map_rounds,
                    ) -> np.ndarray:
    """Measured less simulated position of a log with torque maps in the loop, shape (N, n) [rad].

    The torque enters where the excitation does.  It depends on the motion, so that motion and
    torque are found in turn.
    """
    log = hypothesis.problem.logs[j]
    load, run = np.zeros_like(log.q), log
    for _ in range(rounds):
        q, dq = _motion(hypothesis, j, run)
        for joint_map in maps:
            k = joint_map.joint
            decimated_load = joint_map.load(q[:, k], dq[:, k])
            slow = np.repeat(decimated_load, rows_of(log, hypothesis.problem.period).ticks)
            load[:, k] = np.pad(slow, (0, len(log) - len(slow)), "edge")
        run = dataclasses.replace(log, pe=log.pe - load)
    error = log.q - _positions(hypothesis, j, run)
    return np.nan_to_num(np.clip(error, -DIVERGED, DIVERGED), nan=DIVERGED)


def _motion(hypothesis: Hypothesis, j: int, log: Log | None = None,
            ) -> tuple[np.ndarray, np.ndarray]:
    """Simulated positions and velocities of a log at the rate of the diagnosis."""
    period, log = hypothesis.problem.period, log or hypothesis.problem.logs[j]
    rows = rows_of(log, period)
    q = rows.of_samples(_positions(hypothesis, j, log))
    return q, np.gradient(q, rows.ticks * period, axis=0)


def _positions(hypothesis: Hypothesis, j: int, log: Log) -> np.ndarray:
    """Simulated positions (N, n) of a log; NaN where the model diverges."""
    q, = hypothesis.simulator.positions(log, [hypothesis.of_log(j)], dithered=False)
    return q.T


def _forward(dq: np.ndarray, reversal_speed: float) -> np.ndarray:
    """Share of the forward direction: 1, 0, and between them where the joint reverses."""
    return 0.5 + 0.5 * np.tanh(dq / reversal_speed)


def _joint_map(hypothesis: Hypothesis, motions: Sequence[tuple[np.ndarray, np.ndarray]],
               errors: Sequence[np.ndarray], k: int, method: AssessmentMethod) -> JointTorqueMap:
    """Torque map of joint k by ridge regression on the fit logs."""
    q, dq = ([motion[i][:, k] for motion in motions] for i in (0, 1))
    count = method.map_speeds
    positions = np.linspace(min(map(np.min, q)), max(map(np.max, q)), method.map_positions)
    speeds = max(np.abs(part).max() for part in dq) * np.linspace(1.0 / count, 1.0, count)**1.5
    reversal_speed = method.map_reversal_speed * speeds[-1]
    shapes = [_shapes(*motion, positions, speeds, reversal_speed) for motion in zip(q, dq)]
    grams, rights = _normal_equations(hypothesis, shapes, [error[:, k] for error in errors], k,
                                      method)
    theta, spread = _ridge(grams, rights, method)
    visits = np.abs(np.concatenate(shapes).sum(axis=0))
    parts = [np.split(part.reshape(2, -1), [len(positions)], axis=1)
             for part in (theta, spread, visits)]
    (over_position, over_speed), (position_spread, speed_spread), (visits, _) = parts
    # the level of each direction goes to its speeds
    level = ((over_position * visits).sum(axis=1, keepdims=True)
             / visits.sum(axis=1, keepdims=True))
    return JointTorqueMap(k, positions, speeds, over_position - level, over_speed + level,
                          position_spread, speed_spread, reversal_speed)


def _shapes(q: np.ndarray, dq: np.ndarray, positions: np.ndarray, speeds: np.ndarray,
            reversal_speed: float) -> np.ndarray:
    """Torques (N, columns) of the unit knots: position and speed, forward, then backward."""
    share = _forward(dq, reversal_speed)[:, None]
    hats = np.concatenate([_hats(q, positions), _hats(np.abs(dq), speeds)], axis=1)
    return np.concatenate([share * hats, -(1.0 - share) * hats], axis=1)


def _hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _normal_equations(hypothesis: Hypothesis, shapes: Sequence[np.ndarray],
                      errors: Sequence[np.ndarray], k: int, method: AssessmentMethod,
                      ) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrices and right sides of the parts of the fit logs, one per part."""
    problem, values = hypothesis.problem, hypothesis.values
    sensitivity = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    grams, rights = [], []
    for log, shape, error in zip(problem.fit, shapes, errors):
        rows = rows_of(log, problem.period)
        first = round(method.map_settling / (rows.ticks * problem.period))
        columns = -lfilter(*decimated_filter(*sensitivity, rows.ticks, rows.stride), shape)[first:]
        left = rows.of_samples(error)[first:]
        for some, part in zip(np.array_split(columns, method.map_parts),
                              np.array_split(left, method.map_parts)):
            grams.append(some.T @ some)
            rights.append(some.T @ part)
    return np.array(grams), np.array(rights)


def _ridge(grams: np.ndarray, rights: np.ndarray, method: AssessmentMethod,
           ) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients with the ridge that predicts parts left out best, and their 95 % spread.

    One ridge for all knots, in units of torque: where the motion says little the map is small.
    """
    mean_square = np.trace(grams.sum(axis=0)) / grams.shape[-1]
    fit = ridge_cv(grams, rights, [ridge * mean_square for ridge in method.map_ridges])
    without = fit.left_out
    spread = np.sqrt((1.0 - 1.0 / len(grams)) * ((without - without.mean(axis=0))**2).sum(axis=0))
    return fit.theta, NORMAL_95 * spread
