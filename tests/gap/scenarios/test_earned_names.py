"""A cause is named where unseen data and the law bear it out; else the answer says why."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.torque_path import path_torque
from clie_blocks.analysis.gap.stages import STAGES
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.controller_section import Controller

pytestmark = pytest.mark.slow
ON_THE_DRIVE = {"dead_zone", "actuator_saturation", "actuator_lag", "time_delay",
                "torque_gain_error"}


def answered(robot, records, **choice):
    """The answer as JSON, and in words."""
    diagnosis = diagnose(Problem.from_logs(robot, records, trust_logs=True), **choice)
    return diagnosis.to_dict(), str(diagnosis)


def names(answer):
    return [row["effect"] for row in answer["effects"] if row["probability"] >= 0.5]


def with_unknown_law(made, **stated):
    """Robot and records of which only the torque and the motion are known."""
    law = Controller(law="unknown", sample_time=made.robot.controller.sample_time, **stated)
    robot = dataclasses.replace(made.robot, controller=law)
    return robot, [record.replace(robot=robot, qd=None, pe=None) for record in made.records]


@pytest.mark.parametrize("name", ["coulomb", "none"])
def test_an_excitation_that_was_not_logged_costs_no_name(case, name):
    made = case(name)
    whole, _ = answered(made.robot, made.records)
    answer, words = answered(made.robot, [record.replace(pe=None) for record in made.records])
    assert answer["verdict"] == whole["verdict"] == ("none" if name == "none" else "effect")
    assert names(answer) == names(whole)
    assert not answer["controller_as_stated"]
    assert all(row["followed"] and row["error"] > 10 * row["limit"]
               for row in answer["controller"])
    assert "The logged command is not that of the stated law, by" in words
    assert "pe that was not logged" in words and "No assumptions were needed" not in words
    assert answer["closed_percent"]["judged_by"] == "recorded command"


def test_a_sound_robot_under_a_law_that_is_not_known_is_not_called_sound(case):
    made = case("none")
    law = made.robot.controller
    records = [record.replace(pe=record.pe - 0.05 * law.kp * np.abs(record.q - record.q[0]))
               for record in made.records]
    answer, words = answered(made.robot, records)
    assert answer["verdict"] == "unexplained" and answer["set_90"] == ["unknown"]
    assert not answer["controller_as_stated"]
    assert "a part of the law" in words


def test_a_law_on_the_velocity_error_is_named_and_a_sound_robot_is_sound(case):
    made = case("none")
    law = control_law(made.robot.controller, made.robot.controller.sample_time)
    moving = [record for record in made.records if np.ptp(record.qd) > 0.0]
    assert moving  # the excitation is so logged that the law on the error gives the same command
    records = [record.replace(pe=record.pe - law.kd * law.rate(record.qd))
               for record in made.records]
    answer, words = answered(made.robot, records)
    assert answer["verdict"] == "none" and names(answer) == ["none"]
    assert "Kd (dqd - dq) in the place of -Kd dq" in words


def test_a_command_column_that_holds_something_else_accuses_no_robot(case):
    made, rng = case("coulomb"), np.random.default_rng(0)
    noisy = [record.replace(u=record.u + 0.5 * np.std(record.u) * rng.normal(
        size=record.u.shape)) for record in made.records]
    answer, words = answered(made.robot, noisy)
    assert answer["families"]["friction"] > 0.9 and answer["verdict"] == "effect"
    assert not answer["controller_as_stated"]
    assert not any(row["followed"] for row in answer["controller"])
    assert "models follow the stated law" in words


def test_what_unseen_data_do_not_bear_out_is_not_named(case):
    made = case("coulomb")

    def worse(*arguments):
        found = STAGES.gap_reduction(*arguments)
        return dataclasses.replace(found, percent=-40.0, interval=(-60.0, -20.0), earned=0.0)

    answer, words = answered(made.robot, made.records,
                             stages=dataclasses.replace(STAGES, gap_reduction=worse))
    assert answer["verdict"] == "unexplained" and answer["reason"] == "not_borne_out"
    assert names(answer) == ["unknown"] and answer["set_90"] == ["unknown"]
    (closest,) = answer["closest"]
    assert f"{closest['effect'].replace('_', ' ')} at joint1 would fit these logs best" in words
    assert "does not predict unseen data clearly better" in words


def test_a_model_that_diverges_says_so(case):
    made = case("none")
    light = dataclasses.replace(made.robot, motor=dataclasses.replace(
        made.robot.motor, inertia=0.01 * made.robot.motor.inertia,
        viscous_friction=0.01 * made.robot.motor.viscous_friction), links=type(made.robot.links)())
    answer, words = answered(light, [record.replace(robot=light) for record in made.records])
    assert answer["verdict"] == "unexplained" and answer["reason"] == "diverged"
    assert "The model diverged on these logs" in words and "gains, units and control law" in words


def test_gains_under_which_the_model_diverges_are_left_out(case):
    made = case("coulomb")
    law = made.robot.controller
    robot = dataclasses.replace(made.robot, controller=dataclasses.replace(
        law, kp=-law.kp, kd=-law.kd, velocity_filter="difference", highpass=None,
        lowpass=None, discretisation=None))
    answer, words = answered(robot, [record.replace(robot=robot) for record in made.records])
    assert not answer["controller_as_stated"]
    assert answer["closed_percent"]["judged_by"] == "recorded command with an observer"
    assert "an observer leads the models" in words
    assert answer["families"]["friction"] > 0.9


def test_no_drive_is_accused_where_u_is_a_measured_torque(case):
    robot, records = with_unknown_law(case("coulomb"), u_is="measured")
    answer, words = answered(robot, records)
    assert not ON_THE_DRIVE & {row["effect"] for row in answer["effects"]}
    assert answer["families"]["friction"] > 0.9
    assert answer["closed_percent"]["judged_by"] == "recorded command with an observer"
    assert answer["closed_percent"]["value"] > 50.0 and "with an observer" in words


def test_ramps_of_a_locked_drive_show_its_limit():
    rng, time = np.random.default_rng(0), 0.002 * np.arange(5000)
    robot = Robot(n=1, controller=Controller(law="unknown", sample_time=0.002))
    records = []
    for largest in (40.0, 50.0):
        u = largest * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * time / 5.0))
        tau = path_torque(u, 0.002, 1.0, 0.0, 0.0, 0.0, limit=30.0)
        q = 1e-3 * tau + rng.normal(0, 1e-4, time.size)  # the lock yields
        records.append(Record(time=time, q=q[:, None], u=u[:, None], robot=robot,
                              tau=(tau + rng.normal(0, 0.05, time.size))[:, None]))
    answer, _ = answered(robot, records)
    (limited,) = [row for row in answer["effects"]
                  if row["effect"] in ON_THE_DRIVE and row["probability"] > 0.01]
    assert limited["effect"] == "actuator_saturation" and limited["probability"] > 0.99
    assert limited["parameters"]["limit"]["value"] == pytest.approx([30.0], abs=0.05)
