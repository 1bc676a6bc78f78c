"""The check of a controller with a law of the library, where the stated law did not run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.controller.competition import Competition, compete
from clie_blocks.analysis.gap.controller.library import AT_LIMIT
from clie_blocks.analysis.gap.controller.refit import without_recorded_excitation
from clie_blocks.analysis.gap.controller.replay import ControllerCheck, replay_controller
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.law_residual import rounding_limit

LIMITED = 1e-3  # of the samples, from which a command counts as limited
LEAST_GAIN = 1e-6  # N m/rad, or 1/s, from which a law is found


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
        return _followed_at_its_limit(check, problem)
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
    met = _joints_at_limit(found.law, problem)
    return named if not met else dataclasses.replace(
        named, law=_without_limit(check.law), recorded=True,
        followed=tuple(sorted(explained))).with_decisions([_why_followed(problem, met)])


def _followed_at_its_limit(check: ControllerCheck, problem: Problem) -> ControllerCheck:
    """Check of which models follow the commands where those of the stated law meet its limit."""
    met = _joints_at_limit(check.law, problem)
    return check if not met else dataclasses.replace(
        check, law=_without_limit(check.law), recorded=True,
        followed=tuple(range(problem.n))).with_decisions([_why_followed(problem, met)])


def _why_followed(problem: Problem, joints: Sequence[int]) -> str:
    """What follows of commands that meet a limit."""
    names = ", ".join(problem.joints[k] for k in joints)
    return f"the command of {names} meets a limit, so that models follow the recorded command"


def _without_limit(law: Law) -> Law:
    """PD law nearest to a law that is limited, which holds a model near the robot; else itself."""
    limits = (law.saturation, _largest_rate(law))
    if not isinstance(law, StatedLaw) or not np.any(np.isfinite(limits)):
        return law
    return dataclasses.replace(law.pd, saturation=np.full_like(law.saturation, np.inf))


def _joints_at_limit(law: Law, problem: Problem) -> tuple[int, ...]:
    """Joints whose command meets a limit of a law, or of its rate, for long in any log.

    There the loop is open, and what the noise of an encoder does to the command depends on the
    motion: a model under that law leaves the robot, however right it is, while models that follow
    the recorded command under a law without the limit do not.
    """
    return tuple(np.flatnonzero(np.any([
        _share_at(law.saturation, log.u, law) > LIMITED for log in problem.logs] + [
        _share_at(_largest_rate(law) * law.period, np.diff(log.u, axis=0), law) > LIMITED
        for log in problem.logs], axis=0)).tolist())


def _share_at(limit: np.ndarray, u: np.ndarray, law: Law) -> np.ndarray:
    """Share of the commands, or of their changes, (N, n) that are at a limit (n,); 0 without."""
    return np.mean(np.abs(u) >= AT_LIMIT * limit - law.resolution, axis=0)


def _largest_rate(law: Law) -> np.ndarray:
    """Fastest change of the commands of a law, shape (n,) [N m/s]; infinite without a limit."""
    if not isinstance(law, BlockLaw):
        return np.full_like(law.kp, np.inf)
    rates = [value for (name, _), value in zip(law.block.parameters, law.parameters, strict=True)
             if name.endswith("command_rate")]
    return np.array(rates) if rates else np.full_like(law.kp, np.inf)


def learned_law(problem: Problem) -> ControllerCheck | None:
    """Check of a robot of unknown law whose logs show the law; None where they do not.

    The logs hold commands and references that move, and one law of the library gives all commands.
    """
    law, robot = problem.stated_law, problem.robot
    moving = np.min([np.ptp(log.q_d, axis=0) for log in problem.logs], axis=0)
    if (robot is None or law.holds_joints or law.measured_torque or not np.all(moving > 0.0)
            or any(not log.shows_every_tick for log in problem.logs)):
        return None
    closed = without_recorded_excitation(problem)
    limit = rounding_limit(np.concatenate([log.u for log in closed.logs]), law.resolution)
    for base in (_first_guess(closed, robot.controller), _first_cascade(closed, robot.controller)):
        found = compete(closed, base, limit, range(problem.n), Controller(law="unknown"))
        if len(found.found) == problem.n:
            break
    if found.law is None or len(found.found) < problem.n:
        return None
    said = tuple(one.describe(problem.joints[one.joint], learned=True) for one in found.found)
    zero, joints = np.zeros(problem.n), range(problem.n)
    limited = _joints_at_limit(found.law, problem)
    if limited:
        return dataclasses.replace(
            replay_controller(problem), laws=found.found, learned=True, followed=tuple(joints),
            differences=said).with_decisions([*said, _why_followed(problem, limited)])
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
    def columns(log: Log, k: int) -> list[np.ndarray]:
        q, q_d = log.law_q[:, k], log.q_d[:, k]
        return [q_d - q, -_rate(q, problem), _rate(q_d, problem), np.cumsum(q_d - q)]

    gains = _regression(problem, columns)
    return _starting_from(stated, "pid", kp=np.maximum(gains[0], LEAST_GAIN),
                          ki=np.zeros(problem.n), kd=np.maximum(gains[1], 0.0))


def _first_cascade(problem: Problem, stated: Controller) -> Controller:
    """Cascade with gains that leave least of the commands, to start from.

    Its command is kv kp e - kv v + ki (kp times the sum of e, less the way that q went).
    """
    def columns(log: Log, k: int) -> list[np.ndarray]:
        q, error = log.law_q[:, k], log.q_d[:, k] - log.law_q[:, k]
        return [error, -_rate(q, problem), q[0] - q, np.cumsum(error)]

    gains = _regression(problem, columns)
    kv = np.maximum(gains[1], LEAST_GAIN)
    return _starting_from(stated, "cascade", kp=np.maximum(gains[0] / kv, LEAST_GAIN), kv=kv,
                          ki=np.maximum(gains[2], 0.0))


def _rate(x: np.ndarray, problem: Problem) -> np.ndarray:
    return np.diff(x, prepend=x[0]) / problem.period


def _regression(problem: Problem, columns: Callable[[Log, int], list[np.ndarray]]) -> np.ndarray:
    """Coefficients of some columns, beside a level, in the commands, shape (columns + 1, n)."""
    found = []
    for k in range(problem.n):
        tables = [np.stack([*columns(log, k), np.ones(len(log))], axis=1) for log in problem.logs]
        u = [log.u[:, k] - log.pe[:, k] for log in problem.logs]
        found.append(np.linalg.lstsq(np.concatenate(tables), np.concatenate(u), rcond=None)[0])
    return np.transpose(found)


def _starting_from(stated: Controller, law: str, **gains: Any) -> Controller:
    """A law with gains, and what is stated of its rate, rounding and limits."""
    return Controller(law=law, velocity_filter="difference", sample_time=stated.sample_time,
                      command_resolution=stated.command_resolution, u_is=stated.u_is,
                      saturation=stated.saturation, **gains)


def _nearest(found: Competition, problem: Problem) -> tuple[str, ...]:
    """What is nearest to the commands of joints that no law of the library gives."""
    return tuple(
        f"{problem.joints[k]}: no law of the library gives the logged command; nearest is {name}, "
        f"which leaves {100 * share:.2g} % of it" for k, name, share in found.nearest)
