"""The JSON of a trial has the documented keys, and nothing that JSON lacks."""

import json
from types import SimpleNamespace

import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.cause_shares import Share
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report import answer
from clie_blocks.analysis.gap.verdict.posterior import RankedCause

KEYS = {"schema_version", "verdict", "effects", "set_90", "unexplained", "gap_before",
        "gap_after", "gap_floor", "closed_percent", "where", "next_experiment", "seconds"}


@pytest.fixture(scope="module")
def told(case):
    made = case("quadratic_drag")
    found = diagnose(Problem.from_logs(made.robot, made.records)).to_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    return found


def test_the_documented_keys_are_there(told):
    assert KEYS <= set(told)
    assert told["schema_version"] == 3
    assert told["verdict"] in ("effect", "parametric", "none", "unexplained", "not_identifiable")
    assert isinstance(told["unexplained"], bool)
    assert {"value", "interval"} <= set(told["closed_percent"])
    assert {"joint", "time", "frequency", "region", "block"} <= set(told["where"])
    assert all(told[key] >= 0.0 for key in ("gap_before", "gap_after", "gap_floor", "seconds"))


def test_effects_carry_joint_probability_and_numbers_with_units(told):
    first = told["effects"][0]
    assert {"effect", "joint", "probability", "parameters"} <= set(first)
    for number in first["parameters"].values():
        assert set(number) == {"value", "unit", "interval"}
    (low,), (high,) = first["parameters"]["drag"]["interval"]
    assert low < first["parameters"]["drag"]["value"][0] < high
    assert told["families"]["friction"] == pytest.approx(first["probability"], abs=0.05)
    assert {"none", "unknown"} <= {row["effect"] for row in told["effects"]}


def test_of_names_that_are_alike_the_first_has_the_share_of_the_leading_fit(monkeypatch):
    shares = {"asymmetric_coulomb": Share(0.8, 0.6, 0.7), "payload": Share(0.3, 0.2, 0.25)}
    monkeypatch.setattr(answer, "_shares_of_leading", lambda result: dict(shares))
    monkeypatch.setattr(answer, "_contradicted", lambda result: ())
    ranking = [RankedCause(("asymmetric_coulomb", "payload"), None, 1.0, 0.4),
               RankedCause(("coulomb", "payload"), None, 1.0, 0.35),
               RankedCause(("coulomb",), None, 2.0, 0.25)]
    result = SimpleNamespace(ranking=ranking, alike=[("coulomb", "asymmetric_coulomb")])
    rows = answer._effects(result, [])
    assert [row["effect"] for row in rows] == ["payload", "coulomb", "asymmetric_coulomb"]
    assert [row.get("share", {}).get("mean") for row in rows] == [0.25, 0.7, None]

    apart = SimpleNamespace(ranking=ranking, alike=[])
    rows = answer._effects(apart, [])
    assert [row.get("share", {}).get("mean") for row in rows] == [0.25, None, 0.7]
