"""The control law is found in logs of another engine, and is not invented where none is there."""

import numpy as np
import pytest

from clie_blocks.analysis.cli import main
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.records import Record, read_record, read_robot
from clie_blocks.analysis.records.law_of_log import law_of_logs

LOG = FOLDER / "friction-arm" / "log-2.csv.gz"


def test_gains_and_filter_of_the_other_engine_are_found():
    stated = read_robot(FOLDER / "friction-arm" / "robot.toml").controller
    found = law_of_logs([read_record(LOG)])
    assert found.is_certain
    np.testing.assert_allclose(found.controller.kp, stated.kp, rtol=2e-3)
    np.testing.assert_allclose(found.controller.kd, stated.kd, rtol=2e-3)
    assert found.controller.discretisation == stated.discretisation == "tustin"
    np.testing.assert_allclose(found.controller.corners, stated.corners, rtol=0.01)
    assert found.controller.sample_time == stated.sample_time


def test_a_filter_without_corners_is_preferred_where_it_explains_as_much():
    rng, t = np.random.default_rng(0), 1e-3 * np.arange(2000)
    q = np.round(np.sin(3 * t + 0.2 * np.sin(17 * t)), 5)
    qd = q + 0.02 * np.sin(5 * t) + 1e-3 * rng.standard_normal(t.size)
    u = 30.0 * (qd - q) - 2.0 * np.diff(q, prepend=q[0]) / 1e-3
    found = law_of_logs([Record(t, q[:, None], u=u[:, None], qd=qd[:, None])])
    assert found.controller.velocity_filter == "difference" and found.is_certain
    assert found.controller.kp == pytest.approx([30.0]) and found.controller.kd == pytest.approx(
        [2.0])


def test_torques_that_follow_no_law_give_none():
    rng, t = np.random.default_rng(0), 1e-3 * np.arange(2000)
    q, u = np.sin(3 * t), rng.standard_normal(t.size)
    assert law_of_logs([Record(t, q[:, None], u=u[:, None], qd=q[:, None])]) is None
    assert law_of_logs([Record(t, q[:, None], u=u[:, None])]) is None


def test_a_robot_file_that_is_started_from_a_log_states_its_law(tmp_path):
    assert main(["robot", str(LOG), "-o", str(tmp_path)]) == 0
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.name == "log-2" and robot.controller.law == "pd"
    assert robot.controller.kp == pytest.approx([1.0, 0.22], rel=2e-3)
    assert robot.encoder.resolution == pytest.approx([1e-4, 1e-4])
    assert robot.controller.command_resolution == pytest.approx([5e-4, 1e-4])
