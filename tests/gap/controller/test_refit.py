"""Wrong gains and an unsaid delay of the controller are found, and blamed on no joint."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.hypothesis import held_members
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.verdict.posterior import RankedCause, unknown_for_none


def commanded(problem, commands):
    """The same motions, with other commands."""
    logs = [dataclasses.replace(log, u=np.round(u / problem.law.resolution)
                                * problem.law.resolution)
            for log, u in zip(problem.logs, commands)]
    return dataclasses.replace(problem, fit=tuple(logs[:2]), held_out=tuple(logs[2:]))


@pytest.mark.parametrize("key", ["kp", "kd"])
def test_the_gains_that_ran_are_read_from_the_log(healthy, key):
    gains = getattr(healthy.law, key).copy()
    gains[0] *= 1.04
    ran = dataclasses.replace(healthy.law, **{key: gains})
    found = check_controller(commanded(
        healthy, [ran.replay(log.q, log.q_d, log.pe) for log in healthy.logs]))
    assert found.other_gains == (0,) and not found.other_filter and found.misdescribed
    assert found.law.kp == pytest.approx(ran.kp, rel=1e-3)
    assert found.law.kd == pytest.approx(ran.kd, rel=1e-3)
    assert "the gains that ran" in found.decisions[0]


def test_what_the_law_cannot_say_is_not_called_a_gain(healthy):
    def leaning(log):
        return (healthy.law.replay(log.q, log.q_d, log.pe)
                + 0.05 * healthy.law.kp * healthy.period * np.cumsum(log.q_d - log.q, axis=0))
    problem = commanded(healthy, map(leaning, healthy.logs))
    found = check_controller(problem)
    assert not found.other_gains and not found.delayed and not found.other_filter
    assert found.integral == pytest.approx(0.05 * healthy.law.kp, rel=0.02)
    assert "integral part" in found.decisions[0] and found.misdescribed
    assert not check_controller(found.corrected(problem)).misdescribed


def test_a_drift_of_the_command_is_no_integral(healthy):
    rng = np.random.default_rng(0)

    def drifting(log):
        return (healthy.law.replay(log.q, log.q_d, log.pe) + 20 * healthy.law.resolution
                * np.cumsum(rng.normal(size=log.q.shape), axis=0) / np.sqrt(len(log)))
    assert not check_controller(commanded(healthy, map(drifting, healthy.logs))).integral


def test_a_command_of_the_row_before_is_put_back_and_acts_late(healthy):
    def late(log):
        u = healthy.law.replay(log.q, log.q_d, log.pe)
        return np.concatenate([u[:1], u[:-1]])
    problem = commanded(healthy, map(late, healthy.logs))
    found = check_controller(problem)
    assert found.delayed and not found.other_gains and not found.other_filter
    corrected = found.corrected(problem)
    assert not check_controller(corrected).misdescribed
    (delay,) = held_members(corrected)
    assert delay.cause.name == "time_delay"
    assert delay.values["time"] == pytest.approx(healthy.period)


def test_a_stated_law_that_ran_is_left_as_it_is(healthy):
    found = check_controller(healthy)
    assert not found.misdescribed and found.corrected(healthy).command_delay == 0.0


def test_with_other_gains_nothing_else_is_something_unknown():
    ranking = [RankedCause(("none",), None, 0.0, 0.9), RankedCause(("spring",), None, 0.0, 0.08),
               RankedCause(("unknown",), None, 0.0, 0.02)]
    found = unknown_for_none(ranking)
    assert [s.names[0] for s in found] == ["unknown", "spring", "none"]
    assert [s.probability for s in found] == pytest.approx([0.92, 0.08, 0.0])


def test_a_file_with_another_kd_accuses_no_joint(case):
    """Six percent of Kd are as much as a datasheet's doubt about the damping."""
    made = case("none")
    controller = dataclasses.replace(made.robot.controller, kd=1.06 * made.robot.controller.kd)
    found = answer(
        diagnose(
            Problem.from_logs(dataclasses.replace(made.robot, controller=controller), made.records)
        )
    )
    assert found["verdict"] == "unexplained" and found["set_90"] == ["unknown"]
    assert "kd" in found["decisions"][0]
    assert found["gap_after"] < 1.1 * found["gap_floor"]
