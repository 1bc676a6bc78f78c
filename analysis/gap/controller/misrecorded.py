"""Logged commands that are the law's but late, or times a number: the log's fault or the drive's.

A recorder that writes the command late (`channel_skew`) or scaled (`sensor_gain`) leaves the robot
as it is.  A log with the same columns comes from a drive that is late or weak before its torque is
logged (`time_delay`, `torque_gain_error`), or from gains that all are off by one factor where no
excitation is added.  The signals alone cannot tell; whether the robot moved under the command as
logged does, see `clie_blocks.analysis.gap.command_reading`.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.candidates import CANDIDATES, Candidate
from clie_blocks.analysis.gap.controller.named import Found, NamedJoint, refined
from clie_blocks.analysis.gap.controller.refit import DELAYED_COMMANDS, with_gain_error
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.controller.replayed_joint import joint_of
from clie_blocks.analysis.gap.problem.problem import Problem

SKEW = next(one for one in CANDIDATES if one.name == "channel_skew")
OF_LOG, OF_ROBOT = "log", "robot"  # where the fault is that the signals show


def is_doubtful(check: ControllerCheck, problem: Problem) -> bool:
    """Whether logged commands may be those that acted, or not."""
    return check.delayed or any(_of_robot(one, problem) for one in check.named)


def with_reading(check: ControllerCheck, problem: Problem, order: Sequence[str],
                 ) -> ControllerCheck:
    """Check by which late or scaled commands are a fault of the log, of the robot, or of either.

    Models take the first of `order`; what stands behind it is another name for the same.
    """
    if check.delayed and order == (OF_ROBOT,):
        return check
    law = dataclasses.replace(problem, law=check.law).stated_law
    gains, named = list(check.other_gains), list[NamedJoint]()
    said: dict[str, str] = {}
    for one in _skewed(check, problem) if check.delayed else check.named:
        other = _of_robot(one, problem)
        if other is None:
            named.append(one)
            continue
        by_place = {OF_LOG: one.found[0], OF_ROBOT: other}
        named.append(NamedJoint(one.joint, tuple(by_place[place] for place in order)))
        name, first = problem.joints[one.joint], named[-1].found[0]
        said[one.describe(name)] = named[-1].describe(name)
        if first.name == "gain_error":
            law = with_gain_error(law, one.joint, **first.values)
            gains.append(one.joint)
    added = list(said.values()) if check.delayed else []
    said |= {DELAYED_COMMANDS: ""}
    differences, decisions = (
        tuple(filter(None, [*(said.get(one, one) for one in sentences), *added]))
        for sentences in (check.differences, check.decisions))
    return dataclasses.replace(
        check, law=law, other_gains=tuple(gains), named=tuple(named),
        delayed=check.delayed and order[0] == OF_ROBOT, decisions=decisions,
        differences=differences)


def _skewed(check: ControllerCheck, problem: Problem) -> list[NamedJoint]:
    """Commands that follow from the sample before them, as late in the log alone."""
    named = []
    for k in range(problem.n):
        joint = joint_of(problem, problem.stated_law, k, float(check.limit[k]))
        named.append(NamedJoint(k, (refined(SKEW, {"skew": problem.period}, joint),)))
    return named


def _of_robot(one: NamedJoint, problem: Problem) -> Found | None:
    """What makes the same log of a robot that moves as logged; None of what nothing does."""
    found = one.found[0]
    if not found.is_of_recorder or "bias" in found.values:
        return None
    if found.name == "channel_skew":
        return _renamed(found, "time_delay", {"delay": "skew"})
    if any(np.ptp(log.pe[:, one.joint]) > 0.0 for log in problem.logs):
        return _renamed(found, "torque_gain_error", {"error": "error"})
    return _renamed(found, "gain_error", {"kp_error": "error", "kd_error": "error"})


def _renamed(found: Found, name: str, of: dict[str, str]) -> Found:
    """Another effect with the values of one, parameter by parameter."""
    return dataclasses.replace(
        found, candidate=Candidate(name, tuple(of), lambda joint: iter(())),
        values={new: found.values[old] for new, old in of.items()},
        half={new: found.half[old] for new, old in of.items()})
