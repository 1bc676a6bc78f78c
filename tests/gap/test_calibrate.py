"""Calibration: the numbers serve robots they were not learned on; nothing is made twice."""

import json

import numpy as np

from clie_blocks.analysis.gap import calibrate
from clie_blocks.analysis.gap.evidence import Row, Table
from clie_blocks.analysis.gap.verdict import Calibration


def drawn(count, seed):
    """Robots whose right cause leaves a little more than a wrong one now and then."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        right, wrong = 0.3 * np.exp(rng.normal(0.0, 1.0)), np.exp(rng.normal(1.0, 1.0))
        rows = [Row(("spring",), right, 1), Row(("coulomb",), wrong, 1)]
        found.append(calibrate.Example(Table(50.0, 0.0, 0, (), rows), ("spring",)))
    return found


def test_learned_numbers_are_less_sure_where_the_evidence_misleads():
    numbers = calibrate.learn(drawn(60, 1))
    assert numbers.sharpness < Calibration().sharpness
    judged = drawn(60, 2)
    assert calibrate.loss(numbers, judged) < calibrate.loss(Calibration(), judged)


def test_the_loss_on_robots_left_out_is_told():
    told = calibrate.held_out_loss(drawn(40, 3))
    assert told["after"] < told["before"]


def test_a_run_continues_and_writes_numbers_that_can_be_read(tmp_path, monkeypatch):
    made = []

    def examined(case):
        made.append(case)
        return drawn(1, len(made))[0].table

    monkeypatch.setattr(calibrate, "_evidence", examined)
    monkeypatch.setattr(calibrate, "DURATION", 0.01)
    arguments = ["-n", "10", "--robots", str(tmp_path), "-o", str(tmp_path / "numbers.json")]
    assert calibrate.main(arguments) == 0
    assert calibrate.main(arguments) == 0
    assert len(made) == 10
    told = json.loads((tmp_path / "numbers.json").read_text())
    assert told["robots"] == 10
    assert Calibration(**told["numbers"]).sharpness > 0.0


def test_an_opened_study_is_read_without_what_the_controller_check_decided(tmp_path):
    table = {"nothing": 1.0, "stray": 0.0, "strayed": 0, "free": [], "rows": []}
    (tmp_path / "diagnoses.json").write_text(json.dumps({
        "a": {"evidence": table, "effects": [{"effect": "none"}]},
        "b": {"evidence": table, "effects": [{"effect": "velocity_filter_mismatch"}]}}))
    (tmp_path / "labels.json").write_text(json.dumps({
        "a": {"kind": "none", "labels": ["none"]}, "b": {"kind": "none", "labels": ["none"]}}))
    found = calibrate.read_examples(tmp_path)
    assert [one.truth for one in found] == [("none",)]
