"""Check of a model of the links: its joints must count as those of the log do.

The law proves how signals of one log belong together, but not how the joints of a URDF belong to
them.  The torque that links cause does: weight and inertia follow the pose, and a joint that turns
the other way, or begins elsewhere, has another pose.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.measures import (
    centres,
    half_width,
    moves,
    smooth_motion,
    triangular_mean,
)
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.units import DEGREE
from clie_blocks.rigid_body.dynamics import inverse_dynamics
from clie_blocks.rigid_body.motor_coupling import Matrix, mapped, motor_torques
from clie_blocks.rigid_body.tree import Tree

ENOUGH = 500  # poses that settle the question
TOGETHER = 20  # readings whose torques are computed at once: more do not fit into the cache
MOST_CHANGED, KEPT = 2, 10  # joints at once, and readings of which further changes are tried
CLEAR = 4.0  # logarithm of the factor by which all joints together must be explained better
FAIR = 1.5  # the same of one change of several
SAME = 0.1  # the same of changes that the log does not tell apart
# Times the torque beyond a joint's motion: links that leave more turn against it, or clearly do.
OPPOSED, CLEARLY_OPPOSED = 1.1, 2.0
# Share that links leave at the joint that they explain best: in the right pose, and beyond doubt.
EXPLAINED, WELL_EXPLAINED = 0.5, 0.1
OTHER_BASE = 0.7  # cosine of the angle between two ways to mount a base
HALF_TURN, QUARTER = np.pi, np.pi / 2  # rad: zeros of models differ by quarters of a turn
MANIFOLD = 10.0  # from which a share is no percentage any more
WHY = "A model in another pose than the robot makes its weight look like a fault."


@dataclasses.dataclass(frozen=True, eq=False)
class _Reading:
    """How joints of the log are those of the model, and what is changed in the statement, where.

    Joint k of the model stands at ``sign[k] * scale * q[order[k]] + zero[k]``; torques of the log
    are those of its joints over ``ratio ** gear``.
    """

    order: tuple[int, ...]
    sign: np.ndarray
    zero: np.ndarray
    scale: float = 1.0
    gear: int = 1
    gravity: np.ndarray | None = None
    changes: tuple[str, ...] = ()
    at: tuple[str, ...] = ()

    @classmethod
    def stated(cls, n: int) -> "_Reading":
        return cls(tuple(range(n)), np.ones(n), np.zeros(n))

    def of_model(self, motion: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Position, velocity and acceleration of the joints of the model, each (samples, n)."""
        q, dq, ddq = (self.scale * self.sign * x[:, self.order] for x in motion)
        return q + self.zero, dq, ddq

    def of_log(self, torque: np.ndarray) -> np.ndarray:
        """Torque at the joints of the log for one at those of the model, (samples, n)."""
        found = np.empty_like(torque)
        found[:, self.order] = self.sign * torque
        return found

    def base(self) -> tuple[float, ...] | None:
        """Gravity that was changed, as something to compare."""
        return None if self.gravity is None else tuple(self.gravity.tolist())

    def others(self, names: Sequence[str], tree: Tree) -> Iterator["_Reading"]:
        """Readings with one more change."""
        names = [names[k] for k in self.order]  # of the log, at the joints of the model
        for k, name in enumerate(names):
            shifts = (0,) if tree.slides[k] else (0, -1, 1, 2)
            for turn, quarters in itertools.product((1, -1), shifts):
                what = (["counts in the other direction"] if turn < 0 else []) + (
                    [f"begins {90 * quarters:+d} degrees away"] if quarters else [])
                sign, zero = self.sign.copy(), self.zero.copy()
                sign[k], zero[k] = turn * sign[k], zero[k] + quarters * QUARTER
                if what:
                    yield self._changed(f"{name} {' and '.join(what)}", name, sign=sign, zero=zero)
        for one, other in itertools.combinations(range(len(names)), 2):
            order = list(self.order)
            order[one], order[other] = order[other], order[one]
            yield self._changed(f"{names[one]} and {names[other]} are exchanged", names[one],
                                order=tuple(order))
        if self.gravity is None:
            yield from self._on_other_bases(tree.gravity)
        if self.scale == 1.0:
            yield self._changed("q is in degrees", scale=DEGREE)
        if self.gear == 1:
            yield self._changed("u is on the joint side of the gear", gear=0)
            yield self._changed("gear_ratio is the inverse", gear=-1)

    def _on_other_bases(self, stated: np.ndarray) -> Iterator["_Reading"]:
        """Readings of an arm that hangs, or stands on a wall."""
        size = np.linalg.norm(stated)
        for axis, side in itertools.product(np.eye(3), (-1.0, 1.0)):
            gravity = side * size * axis
            if stated @ gravity < OTHER_BASE * size**2:
                yield self._changed(f"gravity is {_listed(gravity)} m/s^2 as the base sees it",
                                    gravity=gravity)

    def _changed(self, what: str, *at: str, **values: Any) -> "_Reading":
        return dataclasses.replace(self, changes=(*self.changes, what), at=(*self.at, *at),
                                   **values)


def check_link_model(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on a model of the links whose joints are not those of the log as it states."""
    if (robot is None or robot.tree is None or robot.tree.n != record.n or record.u is None
            or set(record.units["u"]) != {"N m"}):
        return []
    weightless = robot.nominal.gravity is False
    comparison = _Comparison.of(record, robot, robot.tree.with_gravity([0.0, 0.0, 0.0])
                                if weightless else robot.tree)
    if comparison is None:
        return []
    stated = _Reading.stated(record.n)
    (left_as_stated,) = comparison.left([stated])
    if _is_right(left_as_stated, WELL_EXPLAINED):
        return []
    best, left = _best(stated, comparison, record.joints)
    if _is_right(left) and _misfit(left_as_stated) - _misfit(left) > CLEAR:
        k = int(np.argmax(left_as_stated / left))
        changes = ", or if ".join(" and ".join(one.changes) for one in best)
        remedies = ", or ".join(_remedy(one, robot, record.joints) for one in best)
        return [Finding(
            "error", "links.joints", f"{_leave(robot, left_as_stated[k])}, and "
            f"{_percent(left[k])} if {changes}.", WHY, f"State {remedies}.",
            joint=next(iter(best[0].at), None))]
    k = int(np.argmax(left_as_stated))
    if left_as_stated[k] < CLEARLY_OPPOSED:
        return []
    gear = ("State gear_ratio first: without it u counts as a torque at the joint. "
            if robot.motor.gear_ratio is None else "")
    return [Finding(
        "warning", "links.opposed", f"{_leave(robot, left_as_stated[k])}: less is left without "
        "them.", WHY, f"{gear}Check the order of the joints, sign, zero_rad, gravity_m_s2, "
        "payload_kg and the masses of the model; no change of one or two joints mends it. A "
        "counterbalance that carries the links shows in this way, too.", joint=record.joints[k])]


def _leave(robot: Robot, left: float) -> str:
    return (f"Of the torque that follows the pose, the links of {robot.links.model} leave "
            f"{_percent(left)} as the file states them")


def _percent(share: float) -> str:
    if share > MANIFOLD:
        return f"{share:.2g} times as much"
    return f"{100 * share:.0f} %" if share > 0.1 else f"{100 * share:.2g} %"


def _is_right(left: np.ndarray, explained: float = EXPLAINED) -> bool:
    """Whether links explain something of the torque at one joint, and turn against none."""
    return bool(left.max() < OPPOSED and left.min() < explained)


def _best(stated: _Reading, comparison: "_Comparison", names: Sequence[str],
          ) -> tuple[list[_Reading], np.ndarray]:
    """Readings that explain most, alike, with as few changes as do, and what they leave.

    Two changes may help together where neither does alone, so several readings are followed.
    """
    best, (left,) = [stated], comparison.left([stated])
    followed = [stated]
    for _ in range(MOST_CHANGED):
        changed = [other for one in followed for other in one.others(names, comparison.tree)]
        ranked = sorted(zip(comparison.left(changed), changed),
                        key=lambda pair: _misfit(pair[0]))
        followed = [one for _, one in ranked[:KEPT]]
        least = _misfit(ranked[0][0])
        is_better = _misfit(left) - least > FAIR
        if _is_right(left) and not is_better:
            break
        if is_better:
            left = ranked[0][0]
            best = [one for shares, one in ranked if _misfit(shares) < least + SAME]
    return best, left


def _misfit(left: np.ndarray) -> float:
    """Sum of logarithms: joints count alike, however much of their torque the links cause."""
    return float(np.log(left).sum())


@dataclasses.dataclass(frozen=True, eq=False)
class _Comparison:
    """Torque of a log beside what the motion of each joint alone explains of it."""

    tree: Tree
    motion: tuple[np.ndarray, np.ndarray, np.ndarray]
    command: np.ndarray
    ratio: np.ndarray
    own: tuple[np.ndarray, ...]
    coupling: Matrix | None

    @classmethod
    def of(cls, record: Record, robot: Robot, tree: Tree) -> "_Comparison | None":
        """Comparison of a log; None of one that is too short, or stands still."""
        width = half_width(record)
        at = centres(record, width)
        at = at[::max(1, at.size // ENOUGH)]
        if at.size < 10 * record.n or record.u is None:
            return None
        q, dq, ddq = smooth_motion(record, at, width)
        command = triangular_mean(record.u, at, width)
        known = np.isfinite(np.column_stack([q, dq, ddq, command])).all(axis=1)
        if known.sum() < 10 * record.n or not all(map(moves, (*q[known].T, *command[known].T))):
            return None
        q, dq, ddq, command = (x[known] for x in (q, dq, ddq, command))
        ratio = robot.motor.gear_ratio
        own = tuple(np.linalg.qr(np.column_stack([*pair, np.sign(pair[0]), np.ones(len(q))]))[0]
                    for pair in zip(dq.T, ddq.T))
        return cls(tree, (q, dq, ddq), command, np.ones(record.n) if ratio is None else ratio, own,
                   robot.motor_coupling)

    def left(self, readings: Sequence[_Reading]) -> np.ndarray:
        """Share of the torque beyond its own motion that the links leave, (readings, n)."""
        gears = self.ratio ** np.array([[float(one.gear)] for one in readings])
        floor = np.finfo(float).eps * self.command.var(axis=0)
        whole = self._beyond(self.command) + floor
        return np.array([(self._beyond(self.command - links / gear) + floor) / whole
                         for links, gear in zip(self._torques(readings), gears)])

    def _torques(self, readings: Sequence[_Reading]) -> Iterator[np.ndarray]:
        """Torques that the links cause at the motors of the log, joint side of their gears.

        Many readings on one base take little longer than one, each operation being in Python.
        """
        motion = self.motion if self.coupling is None else [mapped(self.coupling, x)
                                                            for x in self.motion]
        for base, group in itertools.groupby(readings, _Reading.base):
            tree = self.tree if base is None else self.tree.with_gravity(base)
            alike = list(group)
            for some in (alike[k:k + TOGETHER] for k in range(0, len(alike), TOGETHER)):
                q, dq, ddq = map(np.stack, zip(*(one.of_model(motion) for one in some)))
                for one, torque in zip(some, inverse_dynamics(tree, q, dq, ddq)):
                    torque = one.of_log(torque)
                    yield torque if self.coupling is None else motor_torques(self.coupling, torque)

    def _beyond(self, torque: np.ndarray) -> np.ndarray:
        """Mean square of torques beyond the motion of their own joints, shape (n,)."""
        return np.array([np.mean((x - own @ (own.T @ x)) ** 2)
                         for x, own in zip(torque.T, self.own)])


def _remedy(reading: _Reading, robot: Robot, joints: Sequence[str]) -> str:
    """Lines of the robot file to change."""
    n, links, lines = robot.n, robot.links, []
    sign = np.ones(n) if links.sign is None else links.sign
    zero = np.zeros(n) if links.zero is None else links.zero
    if (reading.sign != 1).any():
        lines.append(f"sign = {_listed(sign * reading.sign)} in [links]")
    if reading.zero.any():
        turned = np.remainder(zero + sign * reading.zero + HALF_TURN, 2 * HALF_TURN) - HALF_TURN
        zero = np.where(reading.zero == 0.0, zero, turned)
        lines.append(f"zero_rad = {_listed(zero)} in [links]")
    if reading.order != tuple(range(n)):
        lines.append("the columns of the log in the order of the model, "
                     f"{', '.join(joints[k] for k in reading.order)}, in [columns]")
    if reading.scale != 1.0:
        lines.append('q = "deg" in [units]')
    if reading.gravity is not None:
        lines.append(f"gravity_m_s2 = {_listed(reading.gravity)} in [links]")
    if reading.gear == 0:
        lines.append("gear_ratio = 1 with inertia and friction on the joint side, or the command "
                     "divided by the gear ratio")
    if reading.gear < 0 and robot.motor.gear_ratio is not None:
        lines.append(f"gear_ratio = {_listed(1.0 / robot.motor.gear_ratio)}, motor turns per "
                     "joint turn, in [motor]")
    return "; ".join(lines)


def _listed(values: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.6g}' for value in np.round(values, 6) + 0.0)}]"
