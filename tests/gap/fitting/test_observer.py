"""Machines that nothing holds are fitted and judged beside an observer."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.observer import with_observer, without_observer
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Motor

PERIOD, INERTIA, DAMPING = 0.005, 0.4, 0.9


def swung(seconds, seed):
    """Log of a free joint under a random command, by plain small steps."""
    rng, fine = np.random.default_rng(seed), 20
    u = np.repeat(rng.normal(0, 1, round(seconds / 0.1)), round(0.1 / PERIOD))
    q, dq, out = 0.0, 0.0, []
    for torque in u:
        out.append(q)
        for _ in range(fine):
            dq += PERIOD / fine * (torque - DAMPING * dq) / INERTIA
            q += PERIOD / fine * dq
    return np.array(out)[:, None], u[:, None]


@pytest.fixture(scope="module")
def loose():
    robot = Robot(n=1, motor=Motor(inertia=[INERTIA], viscous_friction=[DAMPING]),
                  controller=Controller(law="unknown", sample_time=PERIOD))
    records = [Record(time=PERIOD * np.arange(len(q)), q=q, u=u, robot=robot)
               for q, u in (swung(10.0, 1), swung(10.0, 2))]
    return Problem.from_logs(robot, records)


def test_a_loop_that_is_held_is_left_alone(case):
    made = case("none")
    stated = Problem.from_logs(made.robot, made.records)
    assert with_observer(stated, METHOD) is stated
    at = build_hypothesis(stated, ())
    assert without_observer(at, stated) is at


def test_the_observer_takes_nothing_from_a_true_model_and_much_of_a_wrong_one(loose):
    led = with_observer(loose, METHOD)
    assert led.law.kp[0] == pytest.approx(METHOD.fitting.observer_rate**2 * INERTIA, rel=1e-6)
    true = build_hypothesis(led, ())
    wrong = true.with_values({**true.values, "load": np.array([0.05])})
    alone = [np.abs(without_observer(at, loose).error(1, dithered=False)).max()
             for at in (true, wrong)]
    beside = [np.abs(at.error(1, dithered=False)).max() for at in (true, wrong)]
    assert max(alone[0], beside[0]) < 0.02 * alone[1]
    stiffness = METHOD.fitting.observer_rate**2 * INERTIA
    assert beside[1] == pytest.approx(0.05 / stiffness, rel=0.1)  # a spring holds it
    assert alone[1] > 100 * beside[1]


def test_commands_are_those_of_the_observers_law(loose):
    led = with_observer(loose, METHOD)
    for log, stated in zip(led.logs, loose.logs, strict=True):
        np.testing.assert_allclose(led.law.replay(log.q, log.q_d, log.pe), stated.u, atol=1e-9)


def test_a_model_that_learned_from_all_logs_keeps_the_observer(loose):
    led = with_observer(loose, METHOD)
    pooled = dataclasses.replace(led, fit=led.logs, held_out=())
    at = build_hypothesis(pooled, ())
    assert without_observer(at, loose) is at
