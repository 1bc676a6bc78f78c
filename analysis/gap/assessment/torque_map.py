"""What is left and comes back: a table of torque over place and speed, in both directions.

Where a model leaves more than sensor noise, the rest may still be the same in every lap: friction
along a screw, a hard spot of a bearing, a friction curve that no law of the library draws.  Such a
torque names no cause, but a simulator can hold it.  It is fitted beside the model by least squares
through the sensitivity filter, with a ridge that parts of the fit logs choose, and judged in
closed loop on a log that was not fitted.

    torque against the motion = place+(q) + speed+(|dq|)  forward,
                                place-(q) + speed-(|dq|)  backward,     linear between knots
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.assessment.gap_reduction import reduction_percent
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.residual.noise import decimated, decimation
from clie_blocks.analysis.gap.residual.sensitivity import decimated_filter, torque_sensitivity
from clie_blocks.analysis.gap.residual.whitening import DIVERGED
from clie_blocks.linear_filters import lfilter

PLACES, SPEEDS = 16, 8  # knots over the range of the motion
SLOW = 0.02  # of the largest speed: what counts as turning round
SETTLED = 0.5  # s after the start of a log that are not fitted
RIDGES = 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0  # of the mean square of a column
PARTS = 4  # of each fit log, a lap each where a motion is repeated
ROUNDS = 3  # after which motion and table agree
LEFT = 1.5  # times the noise floor, below which nothing is left to be tabled
PAYS = 10.0  # % of the reducible rest


@dataclasses.dataclass(frozen=True, eq=False)
class JointTorqueMap:
    """Table of one joint; a torque counts as positive against the motion.

    Parameters
    ----------
    joint : int
        Index.
    places, speeds : ndarray
        Knots [rad, rad/s].
    over_place, over_speed : ndarray, shape (2, knots)
        Torque forward and backward [N m]; that over place has mean zero over the motion.
    place_spread, speed_spread : ndarray, shape (2, knots)
        Half widths of 95 % intervals, from tables that leave parts of the logs out [N m].

    """

    joint: int
    places: np.ndarray
    speeds: np.ndarray
    over_place: np.ndarray
    over_speed: np.ndarray
    place_spread: np.ndarray
    speed_spread: np.ndarray

    def load(self, q, dq):
        """Torque that opposes, as at port ``load``, for a motion (N,) [N m]."""
        forward, backward = (
            np.interp(q, self.places, place) + np.interp(np.abs(dq), self.speeds, speed)
            for place, speed in zip(self.over_place, self.over_speed))
        share = _forward(dq, self.speeds[-1])
        return share * forward - (1.0 - share) * backward


@dataclasses.dataclass(frozen=True, eq=False)
class TorqueMap:
    """Tables of the joints that have a rest, and what they buy on unseen data.

    Parameters
    ----------
    joints : tuple of JointTable
        One per joint with a rest.
    gap : float
        Gap of the corrected model with the tables, on the judging logs [rad].
    percent : float
        Share of the reducible gap of the model without them that they remove [%].
    interval : tuple of float or None
        Its 95 % interval.
    beside : tuple of str
        Causes that the model holds; none of them for the refitted nominal model.

    """

    joints: tuple
    gap: float
    percent: float
    interval: tuple | None
    beside: tuple

    def as_dict(self):
        """Plain types for the JSON answer; torques count as positive against the motion."""
        return {"percent": self.percent, "interval": self.interval, "gap": self.gap,
                "beside": list(self.beside),
                "unit": {"position": "rad", "speed": "rad/s", "torque": "N m"},
                "joints": [{"joint": table.joint + 1,
                            "over_position": _curves(table.places, table.over_place,
                                                     table.place_spread),
                            "over_speed": _curves(table.speeds, table.over_speed,
                                                  table.speed_spread)}
                           for table in self.joints]}


def torque_map(model, bench):
    """Fit tables to what a model leaves; None where nothing is left or they do not pay.

    Parameters
    ----------
    model : Hypothesis
        The corrected model; the refitted nominal one where no cause is believed.
    bench : Bench
        Whitening.

    """
    problem, floors = model.problem, np.array([noise.floor for noise in bench.noises])
    if not problem.held_out or not _excitable(problem.law):
        return None
    errors = [model.error(j, dithered=False) for j in range(len(problem.logs))]
    judged = validation_logs(problem)
    left = np.sqrt(np.mean(np.concatenate([errors[j] for j in judged])**2, axis=0))
    ailing = np.flatnonzero(left > LEFT * floors)
    if not ailing.size or max(np.abs(error).max() for error in errors) >= DIVERGED:
        return None
    motions = [_motion(model, j) for j in range(len(problem.fit))]
    tables = tuple(_fit(model, motions, errors, k) for k in ailing)
    before, after = ([np.sum(error**2, axis=1) for error in missed] for missed in (
        [errors[j] for j in judged], [corrected_error(model, tables, j) for j in judged]))
    floor = float(np.sqrt(floors @ floors))
    percent, interval = reduction_percent(before, after, floor, problem.period)
    if percent is None or percent < PAYS or (interval and interval[0] < 0.0):
        return None
    return TorqueMap(tables, float(np.sqrt(np.mean(np.concatenate(after)))), percent, interval,
                       tuple(member.cause.name for member in model.members))


def corrected_error(model, tables, j):
    """Measured less simulated position of a log with tables in the loop, shape (N, n) [rad].

    The torque enters where the excitation does.  It depends on the motion, so that motion and
    torque are found in turn.
    """
    log = model.problem.logs[j]
    load, run = np.zeros_like(log.q), log
    for _ in range(ROUNDS):
        q, dq = _motion(model, j, run)
        for table in tables:
            slow = np.repeat(table.load(q[:, table.joint], dq[:, table.joint]),
                             decimation(model.problem.period))
            load[:, table.joint] = np.pad(slow, (0, len(log) - len(slow)), "edge")
        run = dataclasses.replace(log, pe=log.pe - load)
    return np.nan_to_num(np.clip(log.q - _positions(model, j, run), -DIVERGED, DIVERGED),
                         nan=DIVERGED)


def _curves(knots, curves, spread):
    (forward, backward), (of_forward, of_backward) = curves, spread
    return {"at": knots, "forward": forward, "forward_half_width": of_forward,
            "backward": backward, "backward_half_width": of_backward}


def _excitable(law):
    return law.variant != "loop" or law.ports.has_pe


def _motion(model, j, log=None):
    """Simulated positions and velocities of a log at the rate of the diagnosis."""
    period = model.problem.period
    q = decimated(_positions(model, j, log or model.problem.logs[j]), period)
    return q, np.gradient(q, decimation(period) * period, axis=0)


def _positions(model, j, log):
    """Simulated positions (N, n) of a log; NaN where they leave every bound."""
    q, = model.simulator.positions(log, [model.of_log(j)], dithered=False)
    return q.T


def _forward(dq, fastest):
    """Share of the forward direction: 1, 0, and between them where the joint turns round."""
    return 0.5 + 0.5 * np.tanh(dq / (SLOW * fastest))


def _fit(model, motions, errors, k):
    """Table of joint k by ridge regression on the fit logs."""
    q, dq = ([motion[i][:, k] for motion in motions] for i in (0, 1))
    places = np.linspace(min(map(np.min, q)), max(map(np.max, q)), PLACES)
    speeds = max(np.abs(part).max() for part in dq) * np.linspace(1.0 / SPEEDS, 1.0, SPEEDS)**1.5
    shapes = [_shapes(*motion, places, speeds) for motion in zip(q, dq)]
    missed = [error[:, k] for error in errors]
    theta, spread = _ridge(*_normal_equations(model, shapes, missed, k))
    visits = np.concatenate(shapes).sum(axis=0)
    return _map_of_joint(k, places, speeds, theta, spread, np.abs(visits))


def _shapes(q, dq, places, speeds):
    """Torques (N, columns) of the unit knots: place and speed, forward, then backward."""
    share = _forward(dq, speeds[-1])[:, None]
    hats = np.concatenate([_hats(q, places), _hats(np.abs(dq), speeds)], axis=1)
    return np.concatenate([share * hats, -(1.0 - share) * hats], axis=1)


def _hats(x, knots):
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _normal_equations(model, shapes, errors, k):
    """Gram matrices and right sides of the parts of the fit logs, one per part."""
    period, values = model.problem.period, model.values
    b, a = decimated_filter(*torque_sensitivity(model.problem.law, k, values["inertia"][k],
                                      values["damping"][k]), decimation(period))
    first = round(SETTLED / (decimation(period) * period))
    grams, rights = [], []
    for shape, error in zip(shapes, errors):
        columns = -lfilter(b, a, shape)[first:]
        left = decimated(error, period)[first:]
        for rows, part in zip(np.array_split(columns, PARTS), np.array_split(left, PARTS)):
            grams.append(rows.T @ rows)
            rights.append(rows.T @ part)
    return np.array(grams), np.array(rights)


def _ridge(grams, rights):
    """Coefficients with the ridge that predicts parts left out best, and their 95 % spread.

    One ridge for all knots, in units of torque: where the motion says little the table is small.
    """
    whole, right = grams.sum(axis=0), rights.sum(axis=0)
    best = None
    for ridge in RIDGES:
        held = ridge * np.trace(whole) / len(right) * np.eye(len(right))
        without = np.array([np.linalg.solve(whole - gram + held, right - part)
                            for gram, part in zip(grams, rights)])
        drop = (2 * np.einsum("pi,pi", without, rights)
                - np.einsum("pi,pij,pj", without, grams, without))
        if best is None or drop > best[0]:
            best = drop, np.linalg.solve(whole + held, right), without
    _, theta, without = best
    spread = np.sqrt((1.0 - 1.0 / len(grams)) * ((without - without.mean(axis=0))**2).sum(axis=0))
    return theta, 1.96 * spread


def _map_of_joint(k, places, speeds, theta, spread, visits):
    """Table from the coefficients; the level of each direction goes to its speeds."""
    split = [np.split(part.reshape(2, -1), [PLACES], axis=1) for part in (theta, spread, visits)]
    (place, speed), (place_spread, speed_spread), (visited, _) = split
    level = (place * visited).sum(axis=1, keepdims=True) / visited.sum(axis=1, keepdims=True)
    return JointTorqueMap(int(k), places, speeds, place - level, speed + level,
                      place_spread, speed_spread)
