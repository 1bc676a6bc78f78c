"""Arms in space against the engine that moves them, and their model files against the reader."""

import dataclasses

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import ARTICULATED, draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.blind.engine.spatial_links import LAYOUTS  # noqa: E402
from clie_blocks.analysis.blind.engine.world import build_model  # noqa: E402
from clie_blocks.analysis.blind.population.model_files import model_text  # noqa: E402
from clie_blocks.rigid_body.model_file import read_model  # noqa: E402


def robots(count=12):
    return [draw_robot(np.random.default_rng(seed), ARTICULATED) for seed in range(count)]


def engine_at(robot, truth, pose):
    model = build_model(robot, [truth])
    data, mass = mujoco.MjData(model), np.zeros((robot.n, robot.n))
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    return mass.diagonal() - model.dof_armature, data.qfrc_bias


def test_inertia_and_weight_are_those_of_the_engine():
    for robot in robots():
        truth = draw_truth(np.random.default_rng(1), robot) | {"heavier": np.zeros(robot.n)}
        pose = robot.pose + 0.3
        inertia, weight = engine_at(robot, truth, pose)
        assert robot.links.diagonal(pose) == pytest.approx(inertia, rel=1e-9)
        assert robot.links.weight(pose) == pytest.approx(weight, abs=1e-9 * np.abs(weight).max())


def test_arms_of_four_to_seven_joints_have_axes_that_no_plane_holds():
    drawn = robots(25)
    assert {robot.n for robot in drawn} == {4, 5, 6, 7}
    assert all(np.linalg.matrix_rank(robot.links.axis) >= 2 for robot in drawn)
    assert all(len(layout.axes) == len(layout.links) == len(layout.masses) == len(layout.home)
               for layout in LAYOUTS)


def test_a_heavier_link_is_heavier_in_the_engine_and_as_stated_in_its_file():
    robot = robots(1)[0]
    truth = draw_truth(np.random.default_rng(1), robot)
    assert 0.0 < np.abs(truth["heavier"]).max() <= 0.05
    share = np.full(robot.n, 0.25)
    inertia, weight = engine_at(robot, truth | {"heavier": share}, robot.pose)
    assert inertia == pytest.approx(1.25 * robot.links.diagonal(robot.pose))
    assert weight == pytest.approx(1.25 * robot.links.weight(robot.pose), abs=1e-9)


@pytest.mark.parametrize("file", ["arm.urdf", "arm.xml"])
def test_the_model_file_states_the_links_as_they_were_drawn(tmp_path, file):
    for robot in robots(6):
        links = dataclasses.replace(robot.links, file=file)
        (tmp_path / file).write_text(model_text(links))
        tree = read_model(tmp_path / file, tip="tool")
        assert tree.mass == pytest.approx(links.mass, rel=1e-9)
        model = mujoco.MjModel.from_xml_path(str(tmp_path / file))
        data = mujoco.MjData(model)
        data.qpos[:] = robot.pose
        mujoco.mj_forward(model, data)
        assert links.weight(robot.pose) == pytest.approx(data.qfrc_bias, abs=1e-8)
