"""What a diagnosis gives to a simulator, used as it says, reproduces what it predicts."""

import dataclasses
from xml.etree import ElementTree

import pytest

from clie_blocks.analysis.gap import read
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.prediction_error import gap, validation_logs
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.joint_side import PLACES
from clie_blocks.analysis.records import Record
from clie_blocks.errors import ClieError, RecordError
from tests.gap import one_joint
from tests.gap.report import simulators

pytestmark = pytest.mark.slow
PART = 0.5  # of the dry friction, which the user's simulator has already
THINNER = 0.9  # times the damping of the robot, which it has


def written(found, folder):
    """Text of the model that the diagnosis is exported to."""
    found.export("mujoco", folder)
    return (folder / "robot.corrected.xml").read_text()


def gap_in_mujoco(text, found):
    """Gap of a MuJoCo model on the logs that validate the diagnosis."""
    problem, model = found.model.hypothesis.problem, simulators.loaded(text)
    logs = [problem.logs[j] for j in validation_logs(problem)]
    return simulators.gap([simulators.run(model, problem, log) for log in logs], logs)


@pytest.fixture(scope="module")
def rubbing(case):
    """Diagnosis of a robot with dry friction."""
    made = case("coulomb", 5)
    return diagnose(Problem.from_logs(made.robot, made.records), effects=("coulomb",))


@pytest.mark.parametrize("cause, seed", [
    ("coulomb", 5), ("time_delay", 3), ("actuator_saturation", 3), ("asymmetric_coulomb", 3),
    ("actuator_lag", 3)])
def test_the_file_as_it_is_written_reproduces_the_predicted_gap(case, tmp_path, cause, seed):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    made = case(cause, seed)
    found = diagnose(Problem.from_logs(made.robot, made.records), effects=(cause,))
    reached, told = gap_in_mujoco(written(found, tmp_path), found), found.reduction
    assert reached == pytest.approx(told.after, rel=0.06)
    closed = 100.0 * (told.before - reached) / (told.before - told.floor)
    assert closed == pytest.approx(told.percent, abs=10.0) and closed > 75.0


def test_an_arm_of_another_engine_moves_as_its_file_says(shared, tmp_path):
    """A trial of the practice set: the file reaches what the diagnosis predicts."""
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    found = diagnose(read(shared / "blind" / "practice" / "trial-007"), effects=("coulomb",))
    stated = gap(build_hypothesis(found.problem, ()))
    reached = gap_in_mujoco(written(found, tmp_path), found)
    assert reached == pytest.approx(found.reduction.after, rel=0.03)
    assert (reached, stated) == (pytest.approx(2.53e-4, rel=0.02), pytest.approx(5.8e-3, rel=0.02))


def test_a_voltage_on_an_axis_that_slides_is_written_in_kg_and_n(shared, tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    found = diagnose(read(shared / "data" / "emps"), effects=("coulomb",))
    text = written(found, tmp_path)
    assert gap_in_mujoco(text, found) == pytest.approx(found.reduction.after, rel=0.03)
    root = ElementTree.fromstring(text)
    assert root.find(".//joint").get("type") == "slide"
    assert float(root.find(".//inertial").get("mass")) == pytest.approx(95.1, rel=0.02)  # kg
    assert float(root.find(".//general").get("gainprm")) == pytest.approx(35.15, rel=1e-3)  # N/V
    (mass,) = [row for row in found.to_dict()["export"]["joints"] if row["parameter"] == "mass"]
    assert mass["unit"] == "kg" and mass["value"] == pytest.approx(95.1, rel=0.02)


def test_a_percentage_is_not_written_in_si(tmp_path):
    share = 0.05  # N m per percent
    robot, records = one_joint.robot(), one_joint.logs(one_joint.Physics(dry=2.0))
    law = robot.controller
    robot = dataclasses.replace(robot, controller=dataclasses.replace(
        law, kp=law.kp / share, kd=law.kd / share))
    records = [record.replace(u=record.u / share, pe=record.pe / share,
                              units={"u": "%", "pe": "%"}) for record in records]
    found = diagnose(Problem.from_logs(robot, records))
    with pytest.raises(RecordError, match="torque_gain, the torque per percent of rated"):
        found.export("mujoco", tmp_path)
    found.report(tmp_path, "robot")
    page = (tmp_path / "robot.html").read_text()
    assert "per unit of u" in page and "N m" not in page.split("<h2>Thresholds")[0]
    first = found.to_dict()["effects"][0]
    assert first["effect"] == "coulomb" and first["parameters"]["level"]["unit"] == "%"
    assert first["parameters"]["level"]["value"] == pytest.approx([2.0 / share], rel=0.01)


def test_without_the_constant_load_the_gap_stays(rubbing, tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    root = ElementTree.fromstring(written(rubbing, tmp_path))
    for motor in root.iter("general"):
        assert float(motor.get("biasprm").split()[0]) != 0.0
        motor.set("biasprm", "0 0 0")
    without = gap_in_mujoco(ElementTree.tostring(root, encoding="unicode"), rubbing)
    assert without > 2.0 * rubbing.reduction.after


def poorer(text):
    """The user's simulator: part of the dry friction, less damping, no constant load."""
    root = ElementTree.fromstring(text)
    for joint in root.iter("joint"):
        joint.set("damping", str(THINNER * float(joint.get("damping"))))
        if joint.get("frictionloss"):
            joint.set("frictionloss", str(PART * float(joint.get("frictionloss"))))
    for motor in root.iter("general"):
        motor.set("biasprm", "0 0 0")
    return ElementTree.tostring(root, encoding="unicode")


def changed(text, changes):
    """A simulator with the changes of a report made as it says, by the names of MuJoCo."""
    root = ElementTree.fromstring(text)
    joints = {joint.get("name"): joint for joint in root.iter("joint")}
    motors = {motor.get("joint"): motor for motor in root.iter("general")}
    for change in changes:
        own, motor = joints[change["joint"]], motors[change["joint"]]
        _, attribute = PLACES[change["parameter"]].mujoco.partition(",")[0].split()
        if attribute == "biasprm":
            own_value = motor.get("biasprm").split()
            motor.set("biasprm", str(float(own_value[0]) + change["change"]
                                     / float(motor.get("gear"))) + " 0 0")
        else:
            own.set(attribute, str(float(own.get(attribute, 0.0)) + change["change"]))
    return ElementTree.tostring(root, encoding="unicode")


def test_against_a_simulator_only_the_difference_is_written(rubbing, tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    whole = written(rubbing, tmp_path / "whole")
    own, problem = poorer(whole), rubbing.problem
    model, records = simulators.loaded(own), []
    for log, record in zip(problem.logs, problem.records, strict=True):
        q = simulators.run(model, problem, log)
        records.append(Record(time=record.time, q=q, qd=log.q_d, pe=log.pe))
    found = diagnose(problem.beside(records))
    with pytest.raises(ClieError, match="the report lists the changes"):
        found.export("mujoco", tmp_path)
    changes = [row for row in found.to_dict()["export"]["joints"] if row["change"]]
    reached = gap_in_mujoco(changed(own, changes), rubbing)
    assert reached == pytest.approx(found.reduction.after, rel=0.1)
    assert gap_in_mujoco(own, rubbing) > 2.0 * reached
    added = {(row["joint"], row["parameter"]): row["change"] for row in changes}
    for joint in ElementTree.fromstring(whole).iter("joint"):
        lacked = (1.0 - PART) * float(joint.get("frictionloss", 0.0))
        if lacked:
            assert added[joint.get("name"), "frictionloss"] == pytest.approx(lacked, rel=0.1)
