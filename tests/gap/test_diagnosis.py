"""The whole diagnosis, on robots simulated by other code than its own."""

import json

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.errors import ClieError, NotIdentifiableError
from clie_blocks.output import to_json


def said(found):
    return found.verdict, found.ranking[0].names


def test_a_healthy_robot_is_called_healthy(case):
    made = case("none")
    found = diagnose(Problem.from_logs(made.robot, made.records))
    assert said(found) == ("none", ("none",))
    assert found.reduction.before == pytest.approx(found.reduction.floor, rel=0.05)


@pytest.mark.parametrize("effect", [
    "quadratic_drag", pytest.param("dead_zone", marks=pytest.mark.slow)])
def test_an_effect_is_named_with_its_joint_and_closes_the_gap(effect, case):
    made = case(effect)
    found = diagnose(Problem.from_logs(made.robot, made.records))
    assert said(found) == ("effect", (effect,))
    told = json.loads(to_json(answer(found)))
    first = told["effects"][0]
    assert first["joint"] == [made.causes[effect]]
    assert told["gap_after"] < 1.1 * told["gap_floor"] < told["gap_before"]
    assert told["closed_percent"]["interval"][0] > 0.0
    assert sum(e["probability"] for e in told["effects"]) == pytest.approx(1.0, abs=0.02)
    assert told["set_90"] == [effect]


def test_an_effect_left_out_of_the_library_is_unexplained(case):
    made = case("quadratic_drag")
    found = diagnose(Problem.from_logs(made.robot, made.records), effects=["spring", "dead_zone"])
    assert said(found) == ("unexplained", ("unknown",))


def test_an_unknown_effect_is_refused_with_the_nearest_name(case):
    made = case("none")
    with pytest.raises(ClieError, match="did you mean 'coulomb'"):
        diagnose(Problem.from_logs(made.robot, made.records), effects=["colomb"])


def test_a_log_that_is_too_short_is_not_identifiable(case):
    made = case("none")
    short = [record.part(0, 100) for record in made.records]
    with pytest.raises(NotIdentifiableError, match="400"):
        diagnose(Problem.from_logs(made.robot, short))


@pytest.mark.slow
def test_practice_trials(shared):
    from clie_blocks.analysis.gap.batch import Task, diagnose_trial

    folder = shared / "blind" / "practice"
    labels = json.loads((folder / "labels.json").read_text())
    right = []
    for name, label in labels.items():
        told = diagnose_trial(Task(name, (str(folder / name),)))
        named = {e["effect"] for e in told["effects"] if e["probability"] >= 0.5}
        expected = set(label["labels"]) if label["kind"] in ("single", "pair") else {
            label["kind"]}
        right.append(named >= expected)
    assert np.mean(right) >= 0.9


@pytest.mark.slow
def test_a_real_axis_has_dry_friction_and_no_delay(shared):
    from clie_blocks.analysis.records import read_records

    records = read_records(shared / "data" / "emps")
    found = diagnose(Problem.from_logs(records[0].robot, records))
    assert found.ranking[0].names == ("coulomb",)
    assert "time_delay" not in answer(found)["set_90"]
    force_per_volt = records[0].robot.motor.torque_gain[0]
    mass = found.model.hypothesis.values["inertia"][0] * force_per_volt
    assert mass == pytest.approx(95.1, rel=0.03)  # published
