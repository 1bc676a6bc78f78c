"""Maps learned on one engine and tested on the other, on tables whose outcome is plain."""

import json

import pytest

from clie_blocks.analysis.blind.comparison import cross_engine
from clie_blocks.analysis.gap.calibration import learn
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.verdict.evidence import Row, Table, to_json

CLEAR = Table(100.0, 0.0, 0, (), [Row(("coulomb",), 0.1, 2), Row(("backlash",), 80.0, 4)])
HEALTHY = Table(0.1, 0.0, 0, (), [Row(("coulomb",), 0.1, 2)])


def study(*kinds):
    """Diagnoses and labels of robots with plain friction, and of healthy ones."""
    tables = {"single": CLEAR, "none": HEALTHY}
    names = {"single": ["coulomb"], "none": ["none"]}
    found = {str(i): {"evidence": to_json(tables[kind]), "decisions": []}
             for i, kind in enumerate(kinds)}
    return found, {str(i): {"kind": kind, "labels": names[kind]} for i, kind in enumerate(kinds)}


def test_tables_of_a_study_are_read_with_their_truth():
    diagnoses, labels = study("single", "none", "single")
    diagnoses["2"]["decisions"] = ["the velocity filter that ran is another"]
    diagnoses["3"], labels["3"] = {"error": "too short"}, labels["0"]
    found = cross_engine.examples(diagnoses, labels)
    assert [one.truth for one in found] == [("coulomb",), ("none",)]
    assert found[0].table.rows[0].excess == CLEAR.rows[0].excess


def test_each_engine_tests_what_the_other_trained(tmp_path):
    diagnoses, labels = study("single", "none", "single", "none")
    robots = [{**diagnoses["0"]["evidence"], "truth": ["coulomb"]}] * 3
    (tmp_path / "own.json").write_text(json.dumps(robots))
    rows = cross_engine.calibrate_across_engines(tmp_path / "own.json", diagnoses, labels)
    ways = [(row["learned_on"], row["tested_on"], row["robots"]) for row in rows]
    by_hand, own_engine = cross_engine.BY_HAND, cross_engine.OWN_ENGINE
    assert ways == [(by_hand, "MuJoCo", 4), (own_engine, "MuJoCo", 4),
                    (by_hand, own_engine, 3), ("MuJoCo", own_engine, 3)]
    assert all(row["top_1"]["rate"] == 1.0 for row in rows)
    assert all(0.0 <= row["loss"]["value"] < 0.5 for row in rows)


def test_the_loss_is_that_of_the_calibration():
    robots = cross_engine.examples(*study("single", "none"))
    found = cross_engine.evaluate_map(Calibration(), robots, cross_engine.BY_HAND, "MuJoCo")
    assert found["loss"]["value"] == pytest.approx(learn.loss(Calibration(), robots))
