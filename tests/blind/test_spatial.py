"""Arms on a vertical axis: what turns with it depends on where the links are."""

import dataclasses
import types

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine import experiments
from clie_blocks.analysis.blind.engine.experiments import draw_motions  # noqa: E402
from clie_blocks.analysis.blind.engine.robot import draw_robot, link_inertia  # noqa: E402
from clie_blocks.analysis.blind.population import spatial_arms  # noqa: E402
from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS  # noqa: E402
from clie_blocks.analysis.blind.population.files import robot_text  # noqa: E402
from clie_blocks.analysis.blind.population.maker import make_trial  # noqa: E402
from clie_blocks.analysis.blind.population.spatial_arms import SPATIAL, UNTOLD, plan  # noqa: E402

FIRST = np.array([1.0, 0.0, 0.0])


@pytest.mark.parametrize("lift", [0.0, 0.8, np.pi / 2])
def test_the_vertical_axis_turns_the_rotors_and_what_its_links_reach(bench, lift):
    joint = bench("spatial", seed=32)
    robot = joint.robot
    pose = np.array([0.4, lift, 0.0])
    link = link_inertia("spatial", robot.length, robot.mass, robot.com, robot.inertia, pose)
    turned = robot.rotor * robot.ratio**2 - robot.link + link
    torque = 0.2 * robot.kp * FIRST
    experiment = joint.motion(0.01, torque=torque)
    still = np.tile(pose, (len(experiment.q_d), 1))
    experiment = dataclasses.replace(experiment, start=pose, q_d=still)
    q, u = joint.run(experiment, drag=0.0)
    t = robot.period * (len(q) - 1)
    expected = 0.5 * (torque * robot.ratio / turned)[0] * t**2
    assert q[-1, 0] - pose[0] == pytest.approx(expected, rel=0.08)


def test_links_reach_less_about_the_vertical_the_higher_they_are_lifted():
    length, mass, com = np.array([0.1, 0.5, 0.4]), np.array([2.0, 1.0, 0.6]), 0.2 * np.ones(3)
    inertia = np.array([0.03, 0.01, 0.02])
    flat, up = (link_inertia("spatial", length, mass, com, inertia, np.array([0.7, lift, 0.0]))
                for lift in (0.0, np.pi / 2))
    assert flat[0] == pytest.approx(2.0 * 0.04 + 1.0 * 0.3**2 + 0.6 * 0.8**2 + 0.06)
    assert up[0] == pytest.approx(2.0 * 0.04 + 1.6 * 0.1**2 + 0.06)
    assert flat[1:] == pytest.approx(up[1:])


def test_the_file_of_a_spatial_arm_says_nothing_of_its_links():
    rng = np.random.default_rng(4)
    robot = draw_robot(rng, "spatial")
    text = robot_text(robot, draw_motions(rng, robot))
    assert "[links]" not in text and "gravity = false" in text and "coupling = false" in text
    assert np.all(robot.rotor * robot.ratio**2 > robot.link)


def test_half_of_the_arms_are_sound_and_the_others_have_every_effect_they_can():
    plans = [plan(3, index) for index in range(80)]
    assert all(names == () and size is None for names, size in plans[::2])
    assert {name for names, _ in plans[1::2] for name in names} == set(EFFECTS) - set(NEEDS)
    assert {size for _, size in plans[1::2]} == {"medium", "strong"}


def test_the_label_says_what_is_there_and_what_the_links_hold(monkeypatch):
    monkeypatch.setattr(experiments, "DURATIONS", (2.0,))
    index = next(i for i in range(1, 80, 2) if plan(7001, i)[0] == ("dead_zone",))
    label = make_trial(SPATIAL, 7001, index).label
    assert label["labels"] == label["present"] == ["dead_zone"]
    assert label["wrong"].endswith("of the inertia") and label["ratio"] > 1.1
    assert label["robot"] == "spatial of 3" and len(label["effects"][0]["joints"]) == 1


def test_a_sound_arm_has_nothing_that_could_be_named(monkeypatch):
    monkeypatch.setattr(spatial_arms, "afflicted", lambda rng, *asked: types.SimpleNamespace(
        robot=draw_robot(rng, "spatial"), label={}))
    label = make_trial(SPATIAL, 7001, 0).label
    assert label["labels"] == [UNTOLD] and label["present"] == []
