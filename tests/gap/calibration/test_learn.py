"""Calibration: the numbers serve robots they were not learned on; nothing is made twice."""

import dataclasses
import json

import numpy as np
import pytest

from clie_blocks.analysis.gap.calibration import learn
from clie_blocks.analysis.gap.calibration.examples import Example
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause


def drawn(count, seed):
    """Robots whose right cause leaves a little more than a wrong one now and then."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        right, wrong = 0.3 * np.exp(rng.normal(0.0, 1.0)), np.exp(rng.normal(1.0, 1.0))
        rows = [Row(("spring",), right, 1), Row(("coulomb",), wrong, 1)]
        found.append(Example(Table(50.0, 0.0, 0, (), rows), ("spring",)))
    return found


def test_learned_numbers_are_less_sure_where_the_evidence_misleads():
    numbers = learn.learn(drawn(60, 1))
    assert numbers.sharpness < Calibration().sharpness
    judged = drawn(60, 2)
    assert learn.loss(numbers, judged) < learn.loss(Calibration(), judged)


def test_one_number_is_learned_beside_others_that_stay():
    others = Calibration(sharpness=3.0, doubt=0.01)
    numbers = learn.learn(drawn(60, 1), ["doubt"], others)
    assert numbers.doubt != 0.01
    assert dataclasses.replace(numbers, doubt=0.01) == others


def test_each_group_is_judged_by_numbers_learned_on_the_others():
    groups = {name: [dataclasses.replace(one, group=name) for one in drawn(15, seed)]
              for name, seed in (("a", 3), ("b", 4))}
    told = learn.cross_validate(groups["a"] + groups["b"])
    numbers = learn.learn(groups["b"])
    assert told["a"]["loss"] == pytest.approx(learn.loss(numbers, groups["a"]))
    assert told["all"]["robots"] == 30
    assert told["all"]["loss"] == pytest.approx(
        (told["a"]["loss"] + told["b"]["loss"]) / 2)


def test_figures_say_how_sure_and_how_right():
    def ranked(first, probability):
        return [RankedCause((first,), None, 0.0, probability),
                RankedCause(("none",), None, 0.0, 1.0 - probability)]

    told = learn.calibration_figures([(("spring",), ranked("spring", 0.95)),
                              (("coulomb",), ranked("spring", 0.95)),
                              (("none",), ranked("spring", 0.6))])
    assert told["right"] == pytest.approx(1 / 3)
    assert told["certain"] == 2
    assert told["certain_stated_and_right"] == pytest.approx([0.95, 0.5])
    assert told["calibration_error"] == pytest.approx((2 * 0.45 + 0.6) / 3)
    assert told["coverage"] == pytest.approx(2 / 3)
    assert told["set_size"] == pytest.approx(4 / 3)


def test_a_run_continues_and_writes_numbers_that_can_be_read(tmp_path, monkeypatch):
    made = []

    def examined(case):
        made.append(case)
        return drawn(1, len(made))[0].table

    monkeypatch.setattr(learn, "_evidence", examined)
    monkeypatch.setattr(learn, "DURATION", 0.01)
    arguments = ["-n", "10", "--robots", str(tmp_path), "-o", str(tmp_path / "numbers.json")]
    assert learn.main(arguments) == 0
    assert learn.main(arguments) == 0
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
    found = learn.read_examples(tmp_path)
    assert [one.truth for one in found] == [("none",)]


def test_a_kept_robot_whose_effect_hides_in_the_noise_teaches_nothing(tmp_path):
    table = {"stray": 0.0, "strayed": 0, "free": [], "rows": []}
    for i, (nothing, truth) in enumerate([(0.1, "spring"), (0.1, "none"), (9.0, "spring")]):
        (tmp_path / f"robot-{i}.json").write_text(json.dumps(
            {**table, "nothing": nothing, "truth": [truth]}))
    assert [one.truth for one in learn.read_examples(tmp_path)] == [("none",), ("spring",)]
