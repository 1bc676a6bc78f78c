"""Numbers of the robot file that the logs speak against: as stated, and as identified."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import (
    CHANGE,
    COM,
    MASS,
    PARAMETRIC,
    is_number,
    stated_and_identified,
)
from clie_blocks.analysis.gap.causes.vocabulary import TORQUE_CONSTANT, effects_of_number
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import LINK_MASS, TORQUE_SCALE, Member
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.verdict.evidence import prior_violations
from clie_blocks.analysis.gap.verdict.posterior import NONE, RankedCause
from clie_blocks.analysis.statistical_measures import NORMAL_95

LEAST = 0.05  # probability from which a wrong number is named
FAR_END = 0.02  # of a link's length, between two centres of mass that are one from either end


def wrong_numbers(result: Result) -> list[dict[str, Any]]:
    """Numbers of the robot file that are likely wrong, one entry per joint.

    Those of the most probable hypothesis that contradicts the file; its probability is that of
    all such hypotheses together.  Where the logs do not tell other numbers from these, they follow
    as further alternatives: the entries of one alternative hold together.
    """
    likely = [(ranked.fit, ranked.names, ranked.probability) for ranked in result.ranking
              if ranked.fit is not None and _contradicts_file(ranked, ranked.fit, result.method)]
    probability = sum(share for *_, share in likely)
    if not likely or probability < LEAST or result.problem.simulated:
        return []
    leading, names, _ = likely[0]
    alternatives = [leading, *(result.numbers_alike if PARAMETRIC in names else ())]
    return [{**entry, "effects": list(effects_of_number(entry["key"])),
             "probability": probability, "alternative": place}
            for place, fit in enumerate(alternatives, 1) for entry in _of_hypothesis(fit, result)]


def _contradicts_file(ranked: RankedCause, fit: Fit, method: Method) -> bool:
    """Whether a hypothesis says that numbers are wrong, or its causes hold only if they are.

    A model that leaves a gap proves nothing of this kind: its numbers hide what it misses.
    """
    if PARAMETRIC in ranked.names or ranked.names == (NONE,):
        return PARAMETRIC in ranked.names
    return (prior_violations(fit, method.verdict) > 0
            and ranked.excess < method.calibration.healthy)


def _of_hypothesis(fit: Fit, result: Result) -> Iterator[dict[str, Any]]:
    numbers = [member for member in fit.hypothesis.members if is_number(member.cause)]
    for member in numbers:
        yield from (_entry(member, k, fit, result) for k in member.joints)
    if not numbers or prior_violations(fit, result.method.verdict):
        yield from _of_joint_model(fit, result)
        yield from _of_masses(fit, result)
        yield from _of_torque_constants(fit, result)


def _entry(member: Member, k: int, fit: Fit, result: Result) -> dict[str, Any]:
    """Number of the links or the gear at joint k."""
    problem, key = result.problem, member.cause.variant
    name = f"{member.name}.{CHANGE}"
    change = float(fit.hypothesis.values[name][k])
    half = NORMAL_95 * _spread(fit, name, k)
    stated, identified, unit = stated_and_identified(key, change, problem, k)
    ends = sorted(stated_and_identified(key, change + side * half, problem, k)[1]
                  for side in (-1.0, 1.0))
    length = problem.links.length[k]
    far_end = key == COM and abs(stated + identified - length) < FAR_END * length
    return {"key": key, "joint": k + 1, "stated": stated, "identified": identified,
            "interval": ends, "unit": unit,
            "note": "measured from the far end of the link" if far_end else ""}


def _of_joint_model(fit: Fit, result: Result) -> Iterator[dict[str, Any]]:
    """Numbers of the drives, motor side, whose refitted value is beyond the datasheet."""
    problem, motor = result.problem, result.problem.robot and result.problem.robot.motor
    if not motor or motor.inertia is None:
        return
    ratio, stated = problem.gear_ratio, problem.nominal
    links = {"inertia": problem.links.diagonal, "damping": problem.links.bearing_damping}
    for name, key, unit in (("inertia", "motor.inertia_kgm2", "kg m^2"),
                            ("damping", "motor.viscous_friction_nms", "N m s")):
        values, centre = fit.hypothesis.values[name], getattr(stated, name)
        half_widths = NORMAL_95 * np.array([_spread(fit, name, k) for k in range(problem.n)])
        allowed = getattr(stated, f"{name}_tolerance") + half_widths
        for k in map(int, np.flatnonzero(np.abs(values - centre) > allowed)):
            half = half_widths[k] / ratio[k]
            rotor, file = ((side[k] - links[name][k] / ratio[k]) / ratio[k]
                           for side in (values, centre))
            yield {"key": key, "joint": k + 1, "stated": float(file), "identified": float(rotor),
                   "interval": [float(rotor - half), float(rotor + half)], "unit": unit,
                   "note": ""}


def _of_masses(fit: Fit, result: Result) -> Iterator[dict[str, Any]]:
    """Masses of links whose refitted value is beyond the tolerance that the file states."""
    stated = result.problem.links.mass
    for parameter, spread in zip(fit.hypothesis.free_parameters, fit.spread):
        if parameter.key == LINK_MASS:
            k, half = parameter.joint or 0, float(NORMAL_95 * spread)
            mass = float(fit.hypothesis.get(parameter))
            if abs(mass - stated[k]) > (parameter.tolerance or 0.0) + half:
                yield {"key": MASS, "joint": k + 1, "stated": float(stated[k]),
                       "identified": mass, "interval": [mass - half, mass + half], "unit": "kg",
                       "note": ""}


def _of_torque_constants(fit: Fit, result: Result) -> Iterator[dict[str, Any]]:
    """Torque constants whose refitted value is beyond the tolerance that the file states."""
    problem, robot = result.problem, result.problem.robot
    stated = None if robot is None else robot.motor.torque_constant
    if stated is None or not problem.nominal.torque_tolerance:
        return
    for k, error in enumerate(fit.hypothesis.values[TORQUE_SCALE]):
        half = NORMAL_95 * _spread(fit, TORQUE_SCALE, k)
        if abs(error) > problem.nominal.torque_tolerance + half:
            value, wide = float(stated[k] * (1.0 + error)), float(stated[k] * half)
            yield {"key": TORQUE_CONSTANT, "joint": k + 1, "stated": float(stated[k]),
                   "identified": value, "interval": [value - wide, value + wide],
                   "unit": "N m/A", "note": ""}


def _spread(fit: Fit, key: str, k: int) -> float:
    return next((float(spread) for parameter, spread in zip(
        fit.hypothesis.free_parameters, fit.spread)
        if parameter.key == key and parameter.joint in (None, k)), 0.0)
