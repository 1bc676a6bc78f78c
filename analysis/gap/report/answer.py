"""The diagnosis as plain JSON types, in the form that is documented for users."""

import numpy as np

from clie_blocks.analysis.gap.assessment.localisation import block_shares
from clie_blocks.analysis.gap.assessment.ultimate_bound import ultimate_bound
from clie_blocks.analysis.gap.fitting.observer import without_observer
from clie_blocks.analysis.gap.verdict import evidence
from clie_blocks.analysis.gap.verdict.confounders import confounder
from clie_blocks.analysis.gap.verdict.posterior import (
    NONE,
    PARAMETRIC,
    UNKNOWN,
    credible_set,
    marginals,
)
from clie_blocks.analysis.gap.verdict.signal_findings import established_names
from clie_blocks.effects import LIBRARY

SCHEMA_VERSION = 1
LEAST = 1e-4  # probabilities below are left out
DOUBTED = 0.02  # of its probability is left to what an established cause speaks against


def answer(diagnosis, records=()):
    """Return the JSON object of one diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.
    records : sequence of Record, optional
        The logs, whose own decisions are told, too.

    """
    shrunk, given = diagnosis.shrinkage, established_findings(diagnosis)
    advice = diagnosis.next_experiment
    return {
        "schema_version": SCHEMA_VERSION,
        "verdict": diagnosis.verdict,
        "effects": given + _effects(diagnosis, given),
        "set_90": list(dict.fromkeys([*(row["effect"] for row in given), *(
            name for name in credible_set(diagnosis.ranking) if not (given and name == NONE))])),
        "families": _families(diagnosis.ranking, given),
        "unexplained": diagnosis.verdict == "unexplained",
        "gap_before": shrunk.before, "gap_after": shrunk.after, "gap_floor": shrunk.floor,
        "closed_percent": {"value": shrunk.percent, "interval": shrunk.interval,
                           "unseen_data": shrunk.unseen, "judged_on": shrunk.judged_on},
        "theorem_2": _theorem_2(diagnosis),
        "joint_model": _joint_model(diagnosis),
        "simulator": _simulator(diagnosis),
        "repeatable": diagnosis.repeatable and diagnosis.repeatable.as_dict(),
        "noise": [{"sigma": noise.sigma, "unit": "rad"} for noise in diagnosis.bench.noises],
        "where": {**diagnosis.where, "block": block_shares(diagnosis)},
        "next_experiment": advice and advice.as_dict(),
        "controller_as_stated": not diagnosis.check.misdescribed,
        "decisions": list(diagnosis.check.decisions),
        "log_decisions": list(dict.fromkeys(
            said for record in records for said in record.decisions)),
        "evidence": evidence.to_json(diagnosis.evidence),
        "seconds": diagnosis.seconds,
    }


def _theorem_2(diagnosis):
    """What (A.5) predicts of the estimation error, before and after."""
    before, after = (ultimate_bound(without_observer(fit.hypothesis, diagnosis.problem))
                     for fit in (diagnosis.base, diagnosis.model))
    return {"modelling_error": {"before": before[0], "after": after[0], "unit": "rad/s^2"},
            "mu_1": {"before": before[1], "after": after[1]}}


def established_findings(diagnosis):
    """Causes that the way of a command shows, and those that the controller check establishes."""
    by_check = established_names(diagnosis.check, diagnosis.left_out)
    return [cause.as_dict() for cause in (*diagnosis.paths, *by_check)]


def _families(ranking, given):
    """Probability that an effect of a family is at work, whichever it is; likeliest first."""
    found = {}
    for standing in ranking:
        for family in {LIBRARY[name].family for name in standing.names if name in LIBRARY}:
            found[family] = found.get(family, 0.0) + standing.probability
    for row in given:
        family = LIBRARY[row["effect"]].family
        found[family] = max(found.get(family, 0.0), row["probability"])
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _effects(diagnosis, given):
    first = {}
    for standing in diagnosis.ranking:
        for name in standing.names:
            first.setdefault(name, standing.fit)
    named, rows = {row["effect"] for row in given}, []
    for name, probability in marginals(diagnosis.ranking).items():
        if name in _lowered(diagnosis):
            probability *= DOUBTED
        if name in named or (probability < LEAST and name not in (NONE, UNKNOWN)):
            continue
        row = {"effect": name, "joint": None, "probability": probability}
        if name not in (NONE, UNKNOWN, PARAMETRIC):
            row.update(_numbers(name, first[name]), rival=confounder(first[name]))
        rows.append(row)
    return rows


def _lowered(diagnosis):
    """Names that what is established speaks against.

    A wrong controller may be all that is unknown; a late goal or torque does not say so.
    """
    if established_names(diagnosis.check, diagnosis.left_out):
        return NONE, UNKNOWN
    return (NONE,) if diagnosis.paths else ()


def _simulator(diagnosis):
    """Effects that the user's own simulator holds: the robot's numbers beside the simulator's."""
    rows = []
    for member in diagnosis.bench.problem.inside:
        row = {"effect": member.cause.name, **_of_member(member, diagnosis.model)}
        for name, entry in row["parameters"].items():
            entry["simulated"] = member.values[name][..., list(member.joints)]
        rows.append(row)
    return rows


def _numbers(name, fit):
    return _of_member(next(m for m in fit.hypothesis.members if m.cause.name == name), fit)


def _of_member(member, fit):
    spread = intervals(fit)
    at, found = list(member.joints), {}
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
            low_high = None if half is None else [bound[0] for bound in low_high]
        found[number.name] = {"value": value, "unit": number.unit, "interval": low_high}
    return {"joint": [k + 1 for k in at], "parameters": found}


def intervals(fit):
    """Half widths of 95 % intervals of the fitted numbers, by key."""
    found = {}
    for entry, spread in zip(fit.hypothesis.open, fit.spread):
        half = found.setdefault(entry.key, np.full_like(fit.hypothesis.values[entry.key], np.nan))
        where = slice(None) if entry.joint is None else entry.joint
        half[where if entry.log is None else (entry.log, where)] = 1.96 * spread
    return found


def _joint_model(diagnosis):
    """Refitted inertia, damping and offset beside what is stated."""
    nominal, fit = diagnosis.problem.nominal, diagnosis.model
    spread, units = intervals(fit), {"inertia": "kg m^2", "damping": "N m s/rad", "load": "N m"}
    return {name: {"value": fit.hypothesis.values[name], "stated": getattr(nominal, name),
                   "tolerance": getattr(nominal, f"{name}_tolerance"),
                   "interval": [fit.hypothesis.values[name] - spread[name],
                                fit.hypothesis.values[name] + spread[name]], "unit": unit}
            for name, unit in units.items()}
