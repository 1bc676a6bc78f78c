"""Set-points that come late, told from a servo that goes to them on a course of its own."""

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.position_path import fit_position_path
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.servo_delay import shows_delay
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from tests.gap.problem.hanging_servo import PERIOD, Course, log  # noqa: E402

SEEDS = (401, 402, 403)
PROMPT = {"prompt": Course(), "slow": Course(rate=4.0), "fast": Course(rate=10.0),
          "soft": Course(rate=10.0, acceleration=100.0),
          "crisp": Course(rate=20.0, acceleration=400.0)}


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("delay", [0.02, 0.04])
def test_a_delay_is_seen_beside_weight_and_friction(seed, delay):
    late = log(seed, Course(delay=delay))
    assert shows_delay(late, 0)
    path = fit_position_path(late, 0, ("delay", "level", "sag"))
    assert path.delay == pytest.approx(delay, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("course", PROMPT)
def test_a_servo_without_a_delay_has_none(seed, course):
    assert not shows_delay(log(seed, PROMPT[course]), 0)


def test_less_than_half_a_sample_is_no_delay():
    assert not shows_delay(log(SEEDS[0], Course(delay=0.3 * PERIOD)), 0)


def test_set_points_at_rest_in_one_half_show_nothing():
    moved = np.zeros((500, 1))
    moved[300:] = 0.5
    assert not shows_delay(Record(time=PERIOD * np.arange(500), q=moved, qd=moved), 0)


@pytest.mark.parametrize("period, samples", [(PERIOD, 60), (PERIOD, 500), (2.0, 400)])
def test_too_few_moves_show_nothing(period, samples):
    """Shorter than a servo takes to settle, fewer moves than a rank test needs, and a slow log."""
    moved = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, samples // 20), 20)[:, None]
    assert not shows_delay(Record(time=period * np.arange(len(moved)), q=moved, qd=moved), 0)


@pytest.mark.slow
def test_of_two_servos_in_one_log_the_late_one_is_named():
    parts = [log(SEEDS[k], Course(delay=delay)) for k, delay in enumerate((0.04, 0.0))]
    robot = Robot(n=2, controller=Controller(law="unknown", sample_time=PERIOD))
    both = Record(time=parts[0].time, robot=robot, source="two servos",
                  **{name: np.hstack([getattr(part, name) for part in parts])
                     for name in ("q", "qd")})
    found = diagnose(Problem.from_logs(robot, [both]), effects=("time_delay", "coulomb"))
    late, = (one for one in found.findings if one.effect == "time_delay")
    assert late.joints == (0,)
    assert late.parameters["delay"]["value"] == pytest.approx([0.04], abs=1e-3)
    assert {name: len(left) for name, left in late.left.items()} == dict.fromkeys(late.left, 1)
    assert "joint1" in str(found)
