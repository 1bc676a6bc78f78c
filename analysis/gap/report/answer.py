"""The diagnosis as plain JSON types, in the form that is documented for users."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from clie_blocks.analysis.gap.assessment.by_log import parameters_by_log
from clie_blocks.analysis.gap.assessment.cause_shares import Share, shares_of
from clie_blocks.analysis.gap.assessment.localisation import block_shares
from clie_blocks.analysis.gap.assessment.not_shown import not_shown
from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.assessment.ultimate_bound import ultimate_bound
from clie_blocks.analysis.gap.causes.cause import Number
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.controller.terms import UNITS
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import LINK_MASS, TORQUE_SCALE, Member
from clie_blocks.analysis.gap.fitting.observer import without_observer
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.correction import correction
from clie_blocks.analysis.gap.report.description import wrong_numbers
from clie_blocks.analysis.gap.report.joint_side import exported
from clie_blocks.analysis.gap.report.wording import (
    CLOSED_LOOP,
    RECORDED_COMMAND,
    WITH_OBSERVER,
    Row,
    Units,
    local_unit,
    units_of,
)
from clie_blocks.analysis.gap.verdict import evidence
from clie_blocks.analysis.gap.verdict.confounders import confounder
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    NONE,
    PARAMETRIC,
    UNKNOWN,
    RankedCause,
    credible_set,
    marginals,
    probability_of_any,
)
from clie_blocks.analysis.gap.verdict.signal_findings import controller_findings, may_be_all
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.effects import LIBRARY

SCHEMA_VERSION = 3
LEAST = 1e-4  # probabilities below are left out
CONTRADICTED = 0.02  # factor on the probability of what an established cause speaks against


def answer(result: Result) -> dict[str, Any]:
    """Return the JSON object of one diagnosis, in the units of its logs.

    Parameters
    ----------
    result : Result
        From `diagnose`.

    """
    reduction, findings = result.reduction, established_findings(result)
    experiment, records = result.next_experiment, result.problem.records
    plain = _with_units({
        "schema_version": SCHEMA_VERSION,
        "log": log_findings(result.problem),
        "verdict": result.verdict,
        "effects": findings + _effects(result, findings),
        "set_90": list(dict.fromkeys([*(row["effect"] for row in findings), *(
            name for name in credible_set(result.ranking)
            if not (findings and name == NONE))])),
        "families": _families(result.ranking, findings),
        "unexplained": result.verdict == "unexplained",
        "reason": result.reason,
        "complete": result.is_complete,
        "closest": [{"effect": member.cause.name, "joint": [k + 1 for k in member.joints]}
                    for member in result.model.hypothesis.members],
        "gap_before": reduction.before, "gap_after": reduction.after,
        "gap_floor": reduction.floor,
        "closed_percent": {"value": reduction.percent, "interval": reduction.interval,
                           "unseen_data": reduction.unseen, "judged_on": reduction.judged_on,
                           "judged_by": _judged_by(result), "earned": reduction.earned,
                           "only_noise": reduction.only_noise},
        "theorem_2": _theorem_2(result),
        "description": wrong_numbers(result),
        "joint_model": _joint_model(result),
        "simulator": _simulator(result),
        "repeatable": result.torque_map and result.torque_map.as_dict(),
        "formula": result.formula and result.formula.as_dict(),
        "locked": [twist.to_dict() for twist in result.problem.twists],
        "noise": [{"sigma": noise.sigma, "unit": "rad"} for noise in result.residuals.noises],
        "where": {**result.where, "block": block_shares(result)},
        "not_shown": _not_shown(result, findings),
        "advice": list(result.advice),
        "next_experiment": experiment and experiment.as_dict(),
        "controller_as_stated": result.controller.as_stated,
        "controller": _controller(result.controller),
        "controller_differences": list(result.controller.differences),
        "laws": _laws(result.controller),
        "decisions": list(result.controller.decisions),
        "log_decisions": list(dict.fromkeys(
            sentence for record in records for sentence in record.decisions)),
        "evidence": evidence.to_json(result.evidence),
        "seconds": result.seconds,
    }, units_of(records))
    return {**plain, "export": exported(result), "correction": correction(result)}


def by_log(result: Result) -> list[Row]:
    """Parameters of the corrected model from each log alone, in the units of the logs."""
    rows = [{"effect": one.effect, "joint": None if one.joint is None else one.joint + 1,
             "parameter": one.name, "unit": one.unit, "value": one.value,
             "deviation": one.deviation} for one in parameters_by_log(result)]
    converted: list[Row] = _with_units(rows, units_of(result.problem.records))
    return converted


def _laws(controller: ControllerCheck) -> list[dict[str, Any]]:
    """Laws of the library that ran, joint by joint; `learned` where the file states none."""
    return [{"joint": one.joint + 1, "law": one.name, "probability": one.probability,
             "learned": controller.learned, "state": list(one.state),
             "others": [{"law": name, "probability": p} for name, p in one.others],
             "numbers": {name: {"value": value, "half": half, "unit": unit}
                         for name, (value, half, unit) in one.numbers.items()}}
            for one in controller.laws]


def log_findings(problem: Problem) -> dict[str, Any]:
    """What was corrected in the logs, and what the checks found and could not correct."""
    number = {name: k + 1 for k, name in enumerate(problem.joints)}
    return {"corrections": [{**dataclasses.asdict(one), "joint": [number[k] for k in one.joints]}
                            for one in problem.corrections],
            "warnings": [{"check": one.check, "joint": one.joint, "what": one.what,
                          "why": one.why, "fix": one.fix} for one in problem.log_warnings]}


def _not_shown(result: Result, findings: Sequence[Row]) -> list[Row]:
    """Names that the logs could not have shown, but for those that they did show."""
    probability = marginals(result.ranking) | {
        row["effect"]: row["probability"] for row in findings}
    return [{"effect": name, "why": why} for name, why in not_shown(result.problem).items()
            if probability.get(name, 0.0) < LIKELY]


def _with_units(content: Any, units: Units) -> Any:
    """Plain data with every ``unit`` in terms of the logs: an axis in m under a voltage, say."""
    if isinstance(content, dict):
        return {key: _local(value, units) if key == "unit" else _with_units(value, units)
                for key, value in content.items()}
    if isinstance(content, list):
        return [_with_units(value, units) for value in content]
    return content


def _local(unit: Any, units: Units) -> Any:
    if isinstance(unit, dict):
        return {key: local_unit(value, units) for key, value in unit.items()}
    return local_unit(unit, units)


def _theorem_2(result: Result) -> dict[str, Any]:
    """What (A.5) predicts of the estimation error, before and after."""
    before, after = (ultimate_bound(without_observer(fit.hypothesis, result.problem),
                                    result.method.assessment)
                     for fit in (result.nominal, result.model))
    return {"modelling_error": {"before": before[0], "after": after[0], "unit": "rad/s^2"},
            "mu_1": {"before": before[1], "after": after[1]}}


def _judged_by(result: Result) -> str:
    """What drives the models that are compared."""
    if result.controller.open_loop or not result.problem.law.holds_joints:
        return WITH_OBSERVER
    follows = any(piece.reads_record for member in result.model.hypothesis.members
                  for piece in member.cause.pieces)
    return RECORDED_COMMAND if result.controller.recorded or follows else CLOSED_LOOP


def _controller(check: ControllerCheck) -> list[Row]:
    """Joints whose command the stated law does not give, and what it contains beyond."""
    found = {one.joint: one for one in check.terms}
    rows: list[Row] = []
    for k in sorted({*check.left_joints} - {*check.followed}):
        terms = found.get(k)
        coefficients = terms.coefficients if terms else {}
        rows.append({
            "joint": k + 1, "error": check.replay_error[k], "limit": check.limit[k],
            "unit": "N m", "terms": {name: {"value": value, "unit": UNITS[name]}
                                     for name, value in coefficients.items()},
            "velocity_error": bool(terms and terms.is_velocity_error),
            "followed": check.recorded, "led": check.open_loop, "probability": check.reading})
    return rows


def established_findings(result: Result) -> list[Row]:
    """Causes found on the command path, and those that the controller check establishes."""
    by_check = controller_findings(result.controller, result.method.verdict, result.excluded)
    return [finding.as_dict() for finding in (*result.findings, *by_check)]


def _families(ranking: Sequence[RankedCause], findings: Sequence[Row]) -> dict[str, float]:
    """Probability that any effect of a family is present, by family, largest first."""
    families: dict[str, float] = {}
    for ranked in ranking:
        for family in {LIBRARY[name].family for name in ranked.names if name in LIBRARY}:
            families[family] = families.get(family, 0.0) + ranked.probability
    for row in findings:
        family = LIBRARY[row["effect"]].family
        families[family] = max(families.get(family, 0.0), row["probability"])
    return dict(sorted(families.items(), key=lambda item: -item[1]))


def _effects(result: Result, findings: Sequence[Row]) -> list[Row]:
    """Rows of the names in the ranking that are no findings, with their most probable fit.

    Of names that the logs do not tell apart the most probable one has the share.
    """
    first: dict[str, Fit | None] = {}
    for ranked in result.ranking:
        for name in ranked.names:
            first[name] = first.get(name) or ranked.fit
    named = {row["effect"] for row in findings}
    rows: list[Row] = []
    shares = _shares_of_leading(result)
    for name, probability in marginals(result.ranking).items():
        if name in _contradicted(result):
            probability *= CONTRADICTED
        if name in named or (probability < LEAST and name not in (NONE, UNKNOWN)):
            continue
        row: dict[str, Any] = {"effect": name, "joint": None, "probability": probability,
                               "alike": _alike(name, result)}
        if row["alike"]:
            row["together"] = probability_of_any(result.ranking, (name, *row["alike"]))
        fit = first[name]
        if fit is not None and name not in (NONE, UNKNOWN, PARAMETRIC):
            row.update(_parameters(name, fit), rival=confounder(fit, result.residuals))
        share = next((shares.pop(one) for one in (name, *row["alike"]) if one in shares), None)
        if share is not None:
            row["share"] = dataclasses.asdict(share)
        rows.append(row)
    return rows


def _shares_of_leading(result: Result) -> dict[str, Share]:
    """Share of each cause of the leading hypothesis, where it has several."""
    leading = next((ranked for ranked in result.ranking if ranked.fit is not None), None)
    if leading is None or leading.fit is None or len(leading.names) < 2:
        return {}
    return shares_of(leading.fit, result.nominal, result.residuals)


def _alike(name: str, result: Result) -> list[str]:
    """Names that the logs do not tell from one of the answer."""
    return [other for names in result.alike if name in names for other in names if other != name]


def _contradicted(result: Result) -> tuple[str, ...]:
    """Names that an established cause speaks against.

    A wrong controller may be all that is unknown; a delayed set-point or torque, or a coarse
    encoder, is not evidence of that.
    """
    of_law = controller_findings(result.controller, result.method.verdict, result.excluded)
    if may_be_all(of_law, result.residuals.problem):
        return NONE, UNKNOWN
    return (NONE,) if result.findings or of_law else ()


def _simulator(result: Result) -> list[dict[str, Any]]:
    """Effects that the user's own simulator holds: the robot's parameters, and the simulator's."""
    rows = []
    for member in cast(tuple[Member, ...], result.residuals.problem.inside):
        row = {"effect": member.cause.name, **_of_member(member, result.model)}
        for name, entry in row["parameters"].items():
            entry["simulated"] = member.values[name][..., list(member.joints)]
        rows.append(row)
    return rows


def _parameters(name: str, fit: Fit) -> dict[str, Any]:
    return _of_member(next(m for m in fit.hypothesis.members if m.cause.name == name), fit)


def _of_member(member: Member, fit: Fit) -> dict[str, Any]:
    spread, at = intervals(fit), list(member.joints)
    parameters = {}
    for number in member.cause.numbers:
        if number.switch:
            continue
        key = f"{member.name}.{number.name}"
        value = fit.hypothesis.values[key][..., at]
        half = spread.get(key)
        low_high = None if half is None else [
            np.clip(value + side * half[..., at], number.lower, number.upper) for side in (-1, 1)]
        if number.scope == "robot":
            value = value[0]
            low_high = low_high and [bound[0] for bound in low_high]
        parameters[number.name] = {"value": value, "unit": _unit_of(number, member, fit),
                                   "interval": low_high}
    return {"joint": [k + 1 for k in at], "parameters": parameters}


def _unit_of(number: Number, member: Member, fit: Fit) -> str:
    """Unit of a parameter; a weight is a share of that of stated links, and a torque without."""
    if member.cause.name == "gravity" and not fit.hypothesis.problem.links.known:
        return "N m"
    return number.unit


def intervals(fit: Fit) -> dict[str, np.ndarray]:
    """Half widths of 95 % intervals of the fitted parameters, by key."""
    widths: dict[str, np.ndarray] = {}
    for entry, spread in zip(fit.hypothesis.free_parameters, fit.spread):
        half = widths.setdefault(entry.key, np.full_like(fit.hypothesis.values[entry.key], np.nan))
        half[entry.place()] = NORMAL_95 * spread
    return widths


def _joint_model(result: Result) -> dict[str, Any]:
    """Refitted inertia, damping and offset, and what has a tolerance, beside what is stated."""
    nominal, fit, mass = result.problem.nominal, result.model, result.problem.links.mass
    rows = [(name, name, unit, getattr(nominal, name), getattr(nominal, f"{name}_tolerance"))
            for name, unit in (("inertia", "kg m^2"), ("damping", "N m s/rad"), ("load", "N m"))]
    spread = intervals(fit)
    if LINK_MASS in spread:
        rows.append(("mass", LINK_MASS, "kg", mass, nominal.mass_tolerance * mass))
    table = {name: {"value": fit.hypothesis.values[key], "stated": stated, "tolerance": tolerance,
                    "interval": [fit.hypothesis.values[key] - spread[key],
                                 fit.hypothesis.values[key] + spread[key]], "unit": unit}
             for name, key, unit, stated, tolerance in rows}
    if nominal.torque_tolerance and TORQUE_SCALE in spread:
        one, scale = np.ones(fit.hypothesis.problem.n), 1.0 + fit.hypothesis.values[TORQUE_SCALE]
        table["torque"] = {
            "value": scale, "stated": one, "tolerance": nominal.torque_tolerance * one,
            "interval": [scale - spread[TORQUE_SCALE], scale + spread[TORQUE_SCALE]], "unit": "1"}
    return table
