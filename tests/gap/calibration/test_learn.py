"""Calibration: it serves robots that it was not learned on; nothing is made twice."""

import dataclasses
import json

import numpy as np
import pytest
from factories import make_ranked, make_row, make_table

from clie_blocks.analysis.gap.calibration import learn
from clie_blocks.analysis.gap.calibration.examples import Example
from clie_blocks.analysis.gap.method.calibration import Calibration


def drawn(count, seed):
    """Robots whose right cause leaves a little more than a wrong one now and then."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        right, wrong = 0.3 * np.exp(rng.normal(0.0, 1.0)), np.exp(rng.normal(1.0, 1.0))
        table = make_table(50.0, make_row("spring", right), make_row("coulomb", wrong))
        found.append(Example(table, ("spring",)))
    return found


def test_a_learned_calibration_is_less_sure_where_the_evidence_misleads():
    calibration = learn.learn(drawn(60, 1))
    assert calibration.sharpness < Calibration().sharpness
    judged = drawn(60, 2)
    assert learn.loss(calibration, judged) < learn.loss(Calibration(), judged)


def test_one_value_is_learned_while_the_others_stay():
    others = Calibration(sharpness=3.0, leader_uncertainty=0.01)
    calibration = learn.learn(drawn(60, 1), ["leader_uncertainty"], others)
    assert calibration.leader_uncertainty != 0.01
    assert dataclasses.replace(calibration, leader_uncertainty=0.01) == others


def test_each_group_is_assessed_by_a_calibration_learned_on_the_others():
    groups = {name: [dataclasses.replace(one, group=name) for one in drawn(15, seed)]
              for name, seed in (("a", 3), ("b", 4))}
    figures = learn.cross_validate(groups["a"] + groups["b"])
    calibration = learn.learn(groups["b"])
    assert figures["a"]["loss"] == pytest.approx(learn.loss(calibration, groups["a"]))
    assert figures["all"]["robots"] == 30
    assert figures["all"]["loss"] == pytest.approx(
        (figures["a"]["loss"] + figures["b"]["loss"]) / 2)


def test_figures_say_how_sure_and_how_right():
    def ranked(first, probability):
        return [make_ranked(first, probability), make_ranked("none", 1.0 - probability)]

    figures = learn.calibration_figures([(("spring",), ranked("spring", 0.95)),
                              (("coulomb",), ranked("spring", 0.95)),
                              (("none",), ranked("spring", 0.6))])
    assert figures["right"] == pytest.approx(1 / 3)
    assert figures["certain"] == 2
    assert figures["certain_stated_and_right"] == pytest.approx([0.95, 0.5])
    assert figures["calibration_error"] == pytest.approx((2 * 0.45 + 0.6) / 3)
    assert figures["coverage"] == pytest.approx(2 / 3)
    assert figures["set_size"] == pytest.approx(4 / 3)


def test_a_run_continues_and_writes_a_calibration_that_can_be_read(tmp_path, monkeypatch):
    made = []

    def examined(case):
        made.append(case)
        return drawn(1, len(made))[0].table

    monkeypatch.setattr(learn, "_evidence", examined)
    monkeypatch.setattr(learn, "DURATION", 0.01)
    arguments = ["-n", "10", "--robots", str(tmp_path), "-o", str(tmp_path / "method.json")]
    assert learn.main(arguments) == 0
    assert learn.main(arguments) == 0
    assert len(made) == 10
    figures = json.loads((tmp_path / "method.json").read_text())
    assert figures["robots"] == 10
    assert Calibration(**figures["values"]).sharpness > 0.0


def test_an_opened_study_is_read_without_what_the_controller_check_decided(tmp_path):
    table = {"nothing": 1.0, "stray": 0.0, "strayed": 0, "free": [], "rows": []}
    (tmp_path / "diagnoses.json").write_text(json.dumps({
        "a": {"evidence": table, "effects": [{"effect": "none"}]},
        "b": {"evidence": table, "effects": [{"effect": "velocity_filter_mismatch"}]}}))
    (tmp_path / "labels.json").write_text(json.dumps({
        "a": {"kind": "none", "labels": ["none"]}, "b": {"kind": "none", "labels": ["none"]}}))
    found = learn.read_examples(tmp_path)
    assert [one.truth for one in found] == [("none",)]


def test_robots_with_imperfect_logs_are_those_of_their_twins(tmp_path):
    table = {"nothing": 9.0, "stray": 0.0, "strayed": 0, "free": [], "rows": []}
    answer = {"evidence": table, "effects": [{"effect": "spring"}]}
    (tmp_path / "diagnoses.json").write_text(json.dumps({"a": answer}))
    (tmp_path / "labels.json").write_text(json.dumps({"a": {"damage": "gap"}}))
    (tmp_path / "undamaged").mkdir()
    (tmp_path / "undamaged" / "labels.json").write_text(json.dumps({
        "a": {"kind": "single", "labels": ["spring"]}}))
    assert [one.truth for one in learn.read_examples(tmp_path)] == [("spring",)]


def test_a_kept_robot_whose_effect_hides_in_the_noise_is_not_learned_from(tmp_path):
    table = {"stray": 0.0, "strayed": 0, "free": [], "rows": []}
    for i, (nothing, truth) in enumerate([(0.1, "spring"), (0.1, "none"), (9.0, "spring")]):
        (tmp_path / f"robot-{i}.json").write_text(json.dumps(
            {**table, "nothing": nothing, "truth": [truth]}))
    assert [one.truth for one in learn.read_examples(tmp_path)] == [("none",), ("spring",)]
