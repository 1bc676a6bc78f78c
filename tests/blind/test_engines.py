"""Maps learned on one engine and judged on the other, on tables whose outcome is plain."""

import json

import pytest

from clie_blocks.analysis.blind import engines
from clie_blocks.analysis.gap import calibrate
from clie_blocks.analysis.gap.evidence import Row, Table, to_json
from clie_blocks.analysis.gap.verdict import Calibration

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
    found = engines.examples(diagnoses, labels)
    assert [one.truth for one in found] == [("coulomb",), ("none",)]
    assert found[0].table.rows[0].excess == CLEAR.rows[0].excess


def test_each_engine_judges_what_the_other_taught(tmp_path):
    diagnoses, labels = study("single", "none", "single", "none")
    own = [{**diagnoses["0"]["evidence"], "truth": ["coulomb"]}] * 3
    (tmp_path / "own.json").write_text(json.dumps(own))
    rows = engines.compared(tmp_path / "own.json", diagnoses, labels)
    ways = [(row["learned_on"], row["tested_on"], row["robots"]) for row in rows]
    assert ways == [(engines.BY_HAND, "MuJoCo", 4), (engines.OWN, "MuJoCo", 4),
                    (engines.BY_HAND, engines.OWN, 3), ("MuJoCo", engines.OWN, 3)]
    assert all(row["top_1"]["rate"] == 1.0 for row in rows)
    assert all(0.0 <= row["loss"]["value"] < 0.5 for row in rows)


def test_the_loss_is_that_of_the_calibration():
    robots = engines.examples(*study("single", "none"))
    found = engines.judged(Calibration(), robots, engines.BY_HAND, "MuJoCo")
    assert found["loss"]["value"] == pytest.approx(calibrate.loss(Calibration(), robots))
