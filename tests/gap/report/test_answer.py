"""The JSON of a trial has the documented keys, and nothing that JSON lacks."""

import json

import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem

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
