"""The whole diagnosis, on robots simulated by other code than its own."""

import json

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose, read
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.verdict.posterior import marginals
from clie_blocks.errors import ClieError, NotIdentifiableError
from clie_blocks.output import to_json


def verdict_and_leader(diagnosis):
    return diagnosis.verdict, diagnosis.ranking[0].names


def test_a_healthy_robot_is_called_healthy(case):
    robot = case("none")
    diagnosis = diagnose(Problem.from_logs(robot.robot, robot.records))
    assert verdict_and_leader(diagnosis) == ("none", ("none",))
    assert diagnosis.reduction.before == pytest.approx(diagnosis.reduction.floor, rel=0.05)


@pytest.mark.parametrize("effect", [
    "quadratic_drag", pytest.param("dead_zone", marks=pytest.mark.slow)])
def test_an_effect_is_named_with_its_joint_and_closes_the_gap(effect, case):
    robot = case(effect)
    diagnosis = diagnose(Problem.from_logs(robot.robot, robot.records))
    assert verdict_and_leader(diagnosis) == ("effect", (effect,))
    stored = json.loads(to_json(answer(diagnosis)))
    assert stored["effects"][0]["joint"] == [robot.causes[effect]]
    assert stored["gap_after"] < 1.1 * stored["gap_floor"] < stored["gap_before"]
    assert stored["closed_percent"]["interval"][0] > 0.0
    assert sum(row["probability"] for row in stored["effects"]) == pytest.approx(1.0, abs=0.02)
    assert stored["set_90"] == [effect]


def test_an_effect_left_out_of_the_library_is_unexplained(case):
    robot = case("quadratic_drag")
    diagnosis = diagnose(Problem.from_logs(robot.robot, robot.records),
                         effects=["spring", "dead_zone"])
    assert verdict_and_leader(diagnosis) == ("unexplained", ("unknown",))


def test_a_diagnosis_without_time_says_so_and_is_sure_of_nothing(case):
    robot = case("quadratic_drag")
    diagnosis = diagnose(Problem.from_logs(robot.robot, robot.records), seconds=1e-3)
    assert not diagnosis.is_complete and "allow more with --seconds" in str(diagnosis)
    assert len(diagnosis.evidence.rows) == 1  # the likeliest, without a step of its fit
    assert marginals(diagnosis.ranking)["quadratic_drag"] <= 0.7


def test_a_healthy_robot_needs_no_time_for_a_search(case):
    robot = case("none")
    diagnosis = diagnose(Problem.from_logs(robot.robot, robot.records), seconds=1e-3)
    assert verdict_and_leader(diagnosis) == ("none", ("none",)) and diagnosis.is_complete


def test_an_unknown_effect_is_refused_with_the_nearest_name(case):
    robot = case("none")
    with pytest.raises(ClieError, match="did you mean 'coulomb'"):
        diagnose(Problem.from_logs(robot.robot, robot.records), effects=["colomb"])


def test_a_log_that_is_too_short_is_not_identifiable(case):
    robot = case("none")
    short = [record.part(0, 100) for record in robot.records]
    with pytest.raises(NotIdentifiableError, match="400"):
        diagnose(Problem.from_logs(robot.robot, short))


@pytest.mark.slow
def test_practice_trials(shared):
    folder = shared / "blind" / "practice"
    labels = json.loads((folder / "labels.json").read_text())
    is_right = []
    for name, label in labels.items():
        stored = diagnose(read(folder / name)).to_dict()
        likely = {row["effect"] for row in stored["effects"] if row["probability"] >= 0.5}
        expected = set(label["labels"]) if label["kind"] in ("single", "pair") else {
            label["kind"]}
        is_right.append(likely >= expected)
    assert np.mean(is_right) >= 0.9


@pytest.mark.slow
def test_backlash_that_shows_in_the_softened_loop_alone_earns_its_name(shared):
    diagnosis = diagnose(read(shared / "blind" / "set-a" / "trial-020"))
    assert diagnosis.ranking[0].names == ("backlash",)
    assert diagnosis.reduction.earned == 1.0


@pytest.mark.slow
def test_a_real_axis_has_dry_friction_and_no_delay(shared):
    from clie_blocks.analysis.records import read_records

    records = read_records(shared / "data" / "emps")
    diagnosis = diagnose(Problem.from_logs(records[0].robot, records))
    assert diagnosis.ranking[0].names == ("coulomb",)
    assert "time_delay" not in answer(diagnosis)["set_90"]
    force_per_volt = records[0].robot.motor.torque_gain[0]
    mass = diagnosis.model.hypothesis.values["inertia"][0] * force_per_volt
    assert mass == pytest.approx(95.1, rel=0.03)  # published
