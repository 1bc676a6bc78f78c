"""Robots drawn at random: their range, their inertia, and that they carry their own weight."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.parameters import G
from clie_blocks.analysis.blind.engine.robot import (
    SAG,
    draw_robot,
    draw_truth,
    link_inertia,
    restate_links,
)


def test_robots_have_one_to_six_joints_and_gears_up_to_200():
    robots = [draw_robot(np.random.default_rng(k)) for k in range(300)]
    assert {robot.n for robot in robots} == set(range(1, 7))
    assert {robot.n for robot in robots if robot.kind == "arm"} == set(range(2, 7))
    ratios = np.concatenate([robot.ratio for robot in robots])
    assert 1.0 <= ratios.min() < 2.0 and 150.0 < ratios.max() <= 200.0
    assert {robot.period for robot in robots} == {5e-4, 1e-3, 2e-3}
    assert {robot.discretisation for robot in robots} >= {"tustin", "zoh", "backward"}


def test_a_robot_carries_its_own_weight():
    for seed in range(40):
        robot = draw_robot(np.random.default_rng(seed), "arm", True)
        stretched = [G * sum(robot.mass[i] * (robot.length[k:i].sum() + robot.com[i])
                             for i in range(k, robot.n)) for k in range(robot.n)]
        assert np.all(stretched / (robot.kp * robot.ratio) < 1.01 * SAG)


def test_link_inertia_of_a_stretched_arm_is_that_of_its_masses():
    length, mass, com = np.array([0.5, 0.4]), np.array([1.0, 0.6]), np.array([0.2, 0.3])
    inertia, stretched = np.array([0.01, 0.02]), np.array([0.7, 0.0])
    found = link_inertia("arm", length, mass, com, inertia, stretched)
    assert found == pytest.approx([1.0 * 0.04 + 0.01 + 0.6 * 0.8**2 + 0.02, 0.6 * 0.09 + 0.02])


def test_hidden_coupling_leaves_every_joint_its_inertia_at_the_pose():
    robot = draw_robot(np.random.default_rng(8), "arm", False, coupling=False)
    truth = {**draw_truth(np.random.default_rng(9), robot), "links": np.full(robot.n, 0.4)}
    stated = restate_links(robot, truth)
    assert stated.link == pytest.approx(0.4 * robot.link)
    assert stated.rotor * robot.ratio**2 + stated.link == pytest.approx(
        robot.rotor * robot.ratio**2 + robot.link)
    assert not stated.coupling


def test_links_reach_less_about_the_vertical_the_higher_they_are_lifted():
    length, mass, com = np.array([0.1, 0.5, 0.4]), np.array([2.0, 1.0, 0.6]), 0.2 * np.ones(3)
    inertia = np.array([0.03, 0.01, 0.02])
    flat, up = (link_inertia("spatial", length, mass, com, inertia, np.array([0.7, lift, 0.0]))
                for lift in (0.0, np.pi / 2))
    assert flat[0] == pytest.approx(2.0 * 0.04 + 1.0 * 0.3**2 + 0.6 * 0.8**2 + 0.06)
    assert up[0] == pytest.approx(2.0 * 0.04 + 1.6 * 0.1**2 + 0.06)
    assert flat[1:] == pytest.approx(up[1:])
