"""The check of a controller with a law of the library, where the stated law did not run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.competition import Competition, compete
from clie_blocks.analysis.gap.controller.library import AT_LIMIT
from clie_blocks.analysis.gap.controller.refit import without_recorded_excitation
from clie_blocks.analysis.gap.controller.replay import ControllerCheck, replay_controller
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.analysis.records.robot import Controller

LIMITED = 1e-3  # of the samples, from which a command counts as limited


def with_library_law(check: ControllerCheck, problem: Problem) -> ControllerCheck:
    """Check with the law of the library that gives the commands which the stated law does not.

    A single term that the command has beyond the law has a name of its own, and stays.
    """
    several = [one.joint for one in check.terms if len(one.coefficients) > 1]
    joints = sorted({*check.unexplained, *several})
    if check.delayed or problem.robot is None:
        return check
    stated = problem.robot.controller
    if not joints:
        return _followed_where_it_winds_up(check, problem, stated)
    base = (_first_guess(problem, stated) if stated.is_program
            else _as_it_ran(stated, check.law))
    found = compete(problem, base, check.limit, joints, stated)
    if found.law is None:
        return check.with_decisions(_nearest(found, problem))
    explained = {one.joint for one in found.found}
    terms = tuple(one for one in check.terms if one.joint not in explained)
    said = tuple(one.describe(problem.joints[one.joint]) for one in found.found)
    vain = {one.describe(problem.joints[one.joint]) for one in check.terms
            if one.joint in explained}
    named = dataclasses.replace(
        check, law=found.law, replay_error=found.error, limit=found.limit, laws=found.found,
        terms=terms, recorded=bool(terms),
        unexplained=tuple(k for k in check.unexplained if k not in explained),
        differences=(*check.differences, *said),
        decisions=(*(one for one in check.decisions if one not in vain), *said,
                   *_nearest(found, problem)))
    followed = tuple(k for k in sorted(explained) if _is_limited(found, problem, k))
    return named if not followed else dataclasses.replace(
        named, law=_without_limit(check.law), recorded=True,
        followed=tuple(sorted(explained))).with_decisions([_opened(problem, followed)])


def _followed_where_it_winds_up(check: ControllerCheck, problem: Problem, stated: Controller,
                                ) -> ControllerCheck:
    """Check of which models follow the commands where an integral winds up at its limit.

    There the loop is open for as long as the integral takes to unwind, and amplifies whatever a
    model has otherwise.
    """
    law = check.law
    if stated.anti_windup != "none" or not isinstance(law, BlockLaw):
        return check
    met = tuple(k for k in range(problem.n) if _meets_limit(law, problem, k))
    return check if not met else dataclasses.replace(
        check, law=_without_limit(law), recorded=True,
        followed=met).with_decisions([_opened(problem, met)])


def _opened(problem: Problem, joints: Sequence[int]) -> str:
    """What follows of commands that rest at their limit."""
    names = ", ".join(problem.joints[k] for k in joints)
    return f"the command of {names} rests at its limit, so that models follow the recorded command"


def _without_limit(law: Law) -> Law:
    """PD law nearest to a law that is limited, which holds a model near the robot; else itself."""
    if not isinstance(law, BlockLaw) or not np.any(np.isfinite(law.saturation)):
        return law
    return dataclasses.replace(law.pd, saturation=np.full(law.block.n, np.inf))


def _is_limited(found: Competition, problem: Problem, k: int) -> bool:
    """Whether a joint's command meets the limit of the law that ran.

    There the loop is open: a model under that law leaves the robot, however right it is, while
    models that follow the recorded command under a law without the limit do not.
    """
    return found.law is not None and _meets_limit(found.law, problem, k)


def _meets_limit(law: BlockLaw, problem: Problem, k: int) -> bool:
    """Whether a joint's command rests at the limit of a law in any log."""
    least = AT_LIMIT * law.saturation[k] - law.resolution[k]
    return bool(np.isfinite(least)) and any(
        np.mean(np.abs(log.u[:, k]) >= least) > LIMITED for log in problem.logs)


def learned_law(problem: Problem) -> ControllerCheck | None:
    """Check of a robot of unknown law whose logs show the law; None where they do not.

    The logs hold commands and references that move, and one law of the library gives all commands.
    """
    law, robot = problem.stated_law, problem.robot
    moving = np.min([np.ptp(log.q_d, axis=0) for log in problem.logs], axis=0)
    if (robot is None or law.holds_joints or law.measured_torque or not np.all(moving > 0.0)
            or any(log.stride > 1 for log in problem.logs)):
        return None
    closed = without_recorded_excitation(problem)
    limit = rounding_limit(np.concatenate([log.u for log in closed.logs]), law.resolution)
    for base in (_first_guess(closed, robot.controller), _first_cascade(closed, robot.controller)):
        found = compete(closed, base, limit, range(problem.n), Controller(law="unknown"))
        if found.law is not None and len(found.found) == problem.n:
            break
    else:
        return None
    said = tuple(one.describe(problem.joints[one.joint], learned=True) for one in found.found)
    zero, joints = np.zeros(problem.n), range(problem.n)
    limited = [k for k in joints if _is_limited(found, problem, k)]
    if limited:
        return dataclasses.replace(
            replay_controller(problem), laws=found.found, learned=True, followed=tuple(joints),
            differences=said).with_decisions([*said, _opened(problem, limited)])
    return ControllerCheck(
        found.error, found.limit, (), np.full((2, problem.n), np.nan), (), zero, found.law, said,
        said, laws=found.found, learned=True)


def _as_it_ran(stated: Controller, law: object) -> Controller:
    """Controller with the gains that ran, as far as they are known."""
    if not isinstance(law, StatedLaw) or isinstance(law, BlockLaw) or stated.law != "pd":
        return stated
    return dataclasses.replace(stated, kp=law.kp, kd=law.kd)


def _first_guess(problem: Problem, stated: Controller) -> Controller:
    """PID with gains that leave least of the commands, to start from."""
    kp, kd = np.ones(problem.n), np.zeros(problem.n)
    for k in range(problem.n):
        columns, u = [], []
        for log in problem.logs:
            q, q_d = log.law_q[:, k], log.q_d[:, k]
            rate = np.diff(q, prepend=q[0]) / problem.period
            of_reference = np.diff(q_d, prepend=q_d[0]) / problem.period
            columns.append(np.stack([q_d - q, -rate, of_reference, np.cumsum(q_d - q),
                                     np.ones_like(q)], axis=1))
            u.append(log.u[:, k] - log.pe[:, k])
        gains = np.linalg.lstsq(np.concatenate(columns), np.concatenate(u), rcond=None)[0]
        kp[k], kd[k] = max(gains[0], 1e-6), max(gains[1], 0.0)
    return Controller(law="pid", kp=kp, ki=np.zeros(problem.n), kd=kd,
                      velocity_filter="difference", sample_time=stated.sample_time,
                      command_resolution=stated.command_resolution, u_is=stated.u_is,
                      saturation=stated.saturation)


def _first_cascade(problem: Problem, stated: Controller) -> Controller:
    """Cascade with gains that leave least of the commands, to start from.

    Its command is kv kp e - kv v + ki (kp times the sum of e, less the way that q went).
    """
    kp, kv, ki = (np.zeros(problem.n) for _ in range(3))
    for k in range(problem.n):
        columns, u = [], []
        for log in problem.logs:
            q, error = log.law_q[:, k], log.q_d[:, k] - log.law_q[:, k]
            rate = np.diff(q, prepend=q[0]) / problem.period
            total = problem.period * np.cumsum(error)
            columns.append(np.stack([error, -rate, total, q[0] - q, np.ones_like(q)], axis=1))
            u.append(log.u[:, k] - log.pe[:, k])
        gains = np.linalg.lstsq(np.concatenate(columns), np.concatenate(u), rcond=None)[0]
        kv[k], ki[k] = max(gains[1], 1e-6), max(gains[3], 0.0)
        kp[k] = max(gains[0] / kv[k], 1e-6)
    return Controller(law="cascade", kp=kp, kv=kv, ki=ki, velocity_filter="difference",
                      sample_time=stated.sample_time,
                      command_resolution=stated.command_resolution, u_is=stated.u_is,
                      saturation=stated.saturation)


def _nearest(found: Competition, problem: Problem) -> tuple[str, ...]:
    """What is nearest to the commands of joints that no law of the library gives."""
    return tuple(
        f"{problem.joints[k]}: no law of the library gives the logged command; nearest is {name}, "
        f"which leaves {100 * share:.2g} % of it" for k, name, share in found.nearest)
