"""Gains and delays that the file does not state are identified, and attributed to no joint."""

import dataclasses

import numpy as np
import pytest
from factories import make_ranked

from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.controller.refit import COARSE_COMMAND, with_command_rounding
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.hypothesis import held_members
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.verdict.posterior import unknown_for_none


def commanded(problem, command):
    """The same motions, with the rounded commands that a function of a log returns."""
    step = problem.law.resolution
    return problem.with_logs(lambda log: dataclasses.replace(
        log, u=np.round(command(log) / step) * step))


@pytest.mark.parametrize("key", ["kp", "kd"])
def test_the_gains_that_ran_are_read_from_the_log(healthy, key):
    gains = getattr(healthy.law, key).copy()
    gains[0] *= 1.04
    ran = dataclasses.replace(healthy.law, **{key: gains})
    check = check_controller(commanded(healthy, lambda log: ran.replay(log.q, log.q_d, log.pe)))
    assert check.other_gains == (0,) and not check.other_filter and check.misdescribed
    assert check.law.kp == pytest.approx(ran.kp, rel=1e-3)
    assert check.law.kd == pytest.approx(ran.kd, rel=1e-3)
    assert "the gains that ran" in check.decisions[0]


@pytest.mark.slow
def test_an_integral_part_is_not_called_a_gain(healthy):
    def with_integral(log):
        return (healthy.law.replay(log.q, log.q_d, log.pe)
                + 0.05 * healthy.law.kp * healthy.period * np.cumsum(log.q_d - log.q, axis=0))
    problem = commanded(healthy, with_integral)
    check = check_controller(problem)
    assert not check.other_gains and not check.delayed and not check.other_filter
    assert check.integral == pytest.approx(0.05 * healthy.law.kp, rel=0.02)
    assert "integral part" in check.decisions[0] and check.misdescribed
    assert not check_controller(check.corrected(problem)).misdescribed


@pytest.mark.slow
def test_a_drift_of_the_command_is_no_integral(healthy):
    rng = np.random.default_rng(0)

    def drifting(log):
        return (healthy.law.replay(log.q, log.q_d, log.pe) + 20 * healthy.law.resolution
                * np.cumsum(rng.normal(size=log.q.shape), axis=0) / np.sqrt(len(log)))
    assert not check_controller(commanded(healthy, drifting)).integral


def test_a_command_of_the_sample_before_becomes_a_delay_of_the_model(healthy):
    def delayed(log):
        u = healthy.law.replay(log.q, log.q_d, log.pe)
        return np.concatenate([u[:1], u[:-1]])
    problem = commanded(healthy, delayed)
    check = check_controller(problem)
    assert check.delayed and not check.other_gains and not check.other_filter
    corrected = check.corrected(problem)
    assert not check_controller(corrected).misdescribed
    (delay,) = held_members(corrected)
    assert delay.cause.name == "time_delay"
    assert delay.values["delay"] == pytest.approx(healthy.period)


def test_a_stated_law_that_ran_is_left_as_it_is(healthy):
    check = check_controller(healthy)
    assert not check.misdescribed and check.corrected(healthy).command_delay == 0.0


def test_with_other_gains_a_robot_without_a_cause_is_unexplained():
    ranking = unknown_for_none([make_ranked("none", 0.9), make_ranked("spring", 0.08),
                                make_ranked("unknown", 0.02)])
    assert [ranked.names[0] for ranked in ranking] == ["unknown", "spring", "none"]
    assert [ranked.probability for ranked in ranking] == pytest.approx([0.92, 0.08, 0.0])


@pytest.mark.slow
def test_a_file_with_another_kd_is_attributed_to_no_joint(case):
    """Six percent of Kd are as much as the tolerance of the damping in a datasheet."""
    made = case("none")
    controller = dataclasses.replace(made.robot.controller, kd=1.06 * made.robot.controller.kd)
    robot = dataclasses.replace(made.robot, controller=controller)
    stored = answer(diagnose(Problem.from_logs(robot, made.records)))
    assert stored["verdict"] == "effect" and stored["set_90"] == ["gain_error"]
    row = stored["effects"][0]
    assert row["joint"] == [k + 1 for k in range(robot.n)]
    low, high = row["parameters"]["kd_error"]["interval"]
    assert np.all(np.array(low) < 1 / 1.06 - 1) and np.all(np.array(high) > 1 / 1.06 - 1)
    assert "kd" in stored["decisions"][0]
    assert stored["gap_after"] < 1.1 * stored["gap_floor"]


def test_models_get_the_rounding_of_coarse_commands(healthy):
    spread = np.concatenate([log.u for log in healthy.logs]).std(axis=0)
    law = dataclasses.replace(healthy.law, resolution=0.05 * spread)

    def rounded(log):
        u = law.replay(log.q, log.q_d, log.pe)
        return dataclasses.replace(log, u=law.resolution * np.round(u / law.resolution))

    coarse = dataclasses.replace(healthy.with_logs(rounded), law=law)
    for log, got in zip(coarse.logs, with_command_rounding(coarse).logs):
        error = got.pe - log.pe
        assert np.all(np.abs(error) <= law.resolution / 2) and np.all(error.std(axis=0) > 0.0)
        np.testing.assert_allclose(law.replay(got.q, got.q_d, got.pe), log.u, atol=1e-12)


def test_models_get_the_rounding_that_is_louder_than_the_encoder(healthy):
    problem, joints = healthy, range(healthy.n)
    noise = np.array([sensor_noise(problem, k) for k in joints])
    spread = np.concatenate([log.u for log in problem.logs]).std(axis=0)
    equal = np.sqrt(12.0) * problem.law.kp * noise  # a step whose error is as loud as the noise
    assert np.all(0.9 * equal < COARSE_COMMAND * spread)
    quiet, loud = (dataclasses.replace(problem, law=dataclasses.replace(
        problem.law, resolution=share * equal)) for share in (0.9, 1.1))
    assert with_command_rounding(quiet) is quiet
    assert np.any(with_command_rounding(loud).logs[0].pe != loud.logs[0].pe)


def test_fine_commands_and_measured_torques_keep_their_excitation(healthy):
    law = dataclasses.replace(healthy.law, resolution=0.01 * healthy.law.resolution)
    fine = dataclasses.replace(healthy, law=law)
    assert with_command_rounding(fine) is fine
    law = dataclasses.replace(healthy.law, measured_torque=True,
                              resolution=np.ones(healthy.n))
    measured = dataclasses.replace(healthy, law=law)
    assert with_command_rounding(measured) is measured
