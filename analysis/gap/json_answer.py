"""The diagnosis as plain JSON types, in the form that is documented for users."""

import numpy as np

from clie_blocks.analysis.gap.shrinkage import gap
from clie_blocks.analysis.gap.verdict import NONE, UNKNOWN, marginals, set_90

SCHEMA_VERSION = 1


def answer(diagnosis):
    """Return the JSON object of one diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.

    """
    given = established(diagnosis)
    best = next((s for s in diagnosis.ranking if s.fit is not None and s.names != (NONE,)), None)
    leading = diagnosis.ranking[0]
    model = leading.fit if leading.fit is not None else (best.fit if best else diagnosis.base)
    unexplained = leading.names == (UNKNOWN,)
    return {
        "schema_version": SCHEMA_VERSION,
        "verdict": _verdict(leading, given),
        "effects": given + _effects(diagnosis, bool(given)),
        "set_90": [g["effect"] for g in given] or set_90(diagnosis.ranking),
        "unexplained": bool(unexplained and not given),
        "gap_before": gap(diagnosis.base.hypothesis),
        "gap_after": gap(model.hypothesis),
        "gap_floor": float(np.sqrt(sum(noise.floor**2 for noise in diagnosis.bench.noises))),
        "seconds": diagnosis.seconds,
    }


def established(diagnosis):
    """Causes that the controller check alone establishes."""
    check, found = diagnosis.check, []
    if check.wrong:
        found.append({"effect": "velocity_filter_mismatch", "probability": 0.97,
                      "joint": [k + 1 for k in check.wrong],
                      "parameters": {"highpass": {"value": check.corners[0, list(check.wrong)],
                                                  "unit": "rad/s"},
                                     "lowpass": {"value": check.corners[1, list(check.wrong)],
                                                 "unit": "rad/s"}}})
    if check.coarse:
        found.append({"effect": "encoder_quantization", "probability": 0.97,
                      "joint": [k + 1 for k in check.coarse],
                      "parameters": {"step": {"value": check.step[list(check.coarse)],
                                              "unit": "rad"}}})
    return found


def _verdict(leading, given):
    if given:
        return "effect"
    return {NONE: "none", UNKNOWN: "unexplained"}.get(leading.names[0], "effect")


def _effects(diagnosis, given):
    first = {}
    for standing in diagnosis.ranking:
        for name in standing.names:
            first.setdefault(name, standing.fit)
    rows = []
    for name, probability in marginals(diagnosis.ranking).items():
        if given and name == NONE:
            probability *= 0.02
        row = {"effect": name, "joint": None, "probability": probability}
        if name not in (NONE, UNKNOWN):
            row.update(_numbers(name, first[name]))
        rows.append(row)
    return rows


def _numbers(name, fit):
    member = next(m for m in fit.hypothesis.members if m.cause.name == name)
    values = fit.hypothesis.values
    return {"joint": [k + 1 for k in member.joints],
            "parameters": {number.name: {
                "value": values[f"{member.name}.{number.name}"][..., list(member.joints)],
                "unit": number.unit} for number in member.cause.numbers}}
