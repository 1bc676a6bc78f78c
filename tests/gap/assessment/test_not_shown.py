"""What logs could not have shown is said per name, with the reason."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment import not_shown as module
from clie_blocks.analysis.gap.assessment.not_shown import not_shown
from clie_blocks.analysis.gap.causes.vocabulary import effect_names
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.robot_loop.links import planar_links
from tests.gap.scenarios.mujoco_joint import robot_of


def problem(seconds=30.0, rate=500.0, cycles=10.0, size=1.0, law=None, **signals):
    robot = robot_of(law or Controller(law="unknown"))
    time = np.arange(round(seconds * rate)) / rate
    q = size * np.sin(2 * np.pi * cycles * time / seconds)[:, None]
    signals = {name: column(q) for name, column in (signals or {"u": np.negative}).items()}
    return Problem.from_logs(robot, [Record(time=time, q=q, robot=robot, **signals)],
                             trust_logs=True)


def test_every_name_of_the_rules_is_one_of_the_diagnosis():
    groups = ("DRY", "AT_LOW_SPEED", "OF_POSE", "OF_LINKS", "IN_TIME", "OF_TURNS", "OVER_TIME",
              "OF_THE_LAW")
    names = {name for group in groups for name in getattr(module, group)}
    assert names <= effect_names()


@pytest.mark.parametrize("name, why, poor", [
    ("coulomb", "turns round", {"cycles": 0.9}), ("spring", "sweep is 0.4 rad", {"size": 0.2}),
    ("time_delay", "logged at 50 Hz", {"rate": 50.0}), ("step_fault", "5 s", {"seconds": 5.0})])
def test_a_poor_motion_hides_names_that_a_rich_one_shows(name, why, poor):
    assert name not in not_shown(problem())
    assert why in not_shown(problem(**poor))[name]


def test_a_measured_torque_shows_no_drive():
    law = Controller(law="unknown", u_is="measured")
    assert "measured torque" in not_shown(problem(law=law))["dead_zone"]
    assert "dead_zone" not in not_shown(problem())


def test_without_a_torque_gain_and_friction_are_not_told_apart():
    stated = Controller(law="pd", kp=[10.0], kd=[1.0], velocity_filter="difference")
    hidden = not_shown(problem(law=stated, qd=lambda q: np.roll(q, -5)))
    assert "no torque is logged" in hidden["torque_gain_error"] and "gain_error" in hidden


def test_stated_links_show_a_payload():
    bare = problem()
    assert "states no links" in not_shown(bare)["payload"]
    links = planar_links([0.4], [0.3], [0.2], [0.0], has_gravity=True)
    assert "payload" not in not_shown(dataclasses.replace(bare, links=links))
