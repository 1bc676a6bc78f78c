"""Robots of another engine whose law reads the torque that the drive senses."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from law_robots import (  # noqa: E402
    FRICTION,
    PERIOD,
    PROGRAM,
    STEP,
    SUBSTEPS,
    TORQUE_PROGRAM,
    TORQUE_RATE,
    Robot,
    pd_around_torque,
)

from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.export.simulated_model import law_in_steps  # noqa: E402
from clie_blocks.analysis.gap.controller.check import check_controller  # noqa: E402
from clie_blocks.errors import NotIdentifiableError  # noqa: E402

AROUND_TORQUE = Robot(pd_around_torque, PROGRAM, program=TORQUE_PROGRAM,
                      options={"senses_torque": True})
LAG = 8e-3  # s, of a drive


def read(folder):
    return gap.read(folder, run_law=True)


def behind_a_lag():
    """Drive whose torque follows the command behind a lag, at rest at first."""
    torque, pole = np.zeros(1), np.exp(-PERIOD / SUBSTEPS / LAG)

    def drive(u, dq):
        nonlocal torque
        torque = pole * torque + (1.0 - pole) * u
        return torque.copy()
    return drive


def test_the_law_gives_the_commands_on_the_logged_torque(tmp_path):
    weak = {"senses_torque": True, "torque": lambda u, dq: 0.7 * u}  # what a drive does is its own
    dataclasses.replace(AROUND_TORQUE, options=weak).write(tmp_path, seconds=2.0)
    problem = read(tmp_path)
    check = check_controller(problem)
    assert check.as_stated and np.all(check.replay_error < 0.4 * STEP)
    log = problem.logs[0]
    in_steps = law_in_steps(problem, log)
    np.testing.assert_allclose([in_steps(i, q) for i, q in enumerate(log.law_q)], log.u, atol=STEP)


def test_a_wrong_number_of_the_torque_loop_is_found(tmp_path):
    wrong = TORQUE_PROGRAM.replace(f'"rate": {TORQUE_RATE}', '"rate": 45.0')
    dataclasses.replace(AROUND_TORQUE, program=wrong).write(tmp_path, seconds=2.0)
    ran, = check_controller(read(tmp_path)).parameters
    assert ran.name == "rate" and ran.value == pytest.approx(TORQUE_RATE, rel=1e-3)


@pytest.mark.parametrize("header, message", [
    ("tau1[A]", r"log-1.csv: the law 'torque loop' reads tau\[k\], which is logged in A, and its "
                "commands u are in N m.*one unit"),
    ("other", r"reads tau\[k\], and the log has no tau.*column tau1.*from its own commands")])
def test_a_torque_that_a_model_cannot_make_is_refused(tmp_path, header, message):
    AROUND_TORQUE.write(tmp_path, seconds=1.0)
    for path in tmp_path.glob("*.csv"):
        path.write_text(path.read_text().replace("tau1", header, 1))
    with pytest.raises(NotIdentifiableError, match=message):
        read(tmp_path)


@pytest.mark.slow
def test_a_sound_robot_around_a_torque_is_sound(tmp_path):
    AROUND_TORQUE.write(tmp_path)
    diagnosis = gap.diagnose(read(tmp_path))
    answer = diagnosis.to_dict()
    assert diagnosis.verdict == "none" and diagnosis.controller.as_stated
    assert answer["gap_before"] == pytest.approx(answer["gap_floor"], rel=0.1)


@pytest.mark.slow
def test_friction_is_named_behind_a_loop_around_the_torque(tmp_path):
    AROUND_TORQUE.write(tmp_path, "coulomb", logs=3)
    first = gap.diagnose(read(tmp_path)).to_dict()["effects"][0]
    assert first["effect"] == "coulomb"
    assert first["parameters"]["level"]["value"][0] == pytest.approx(FRICTION, rel=0.03)


@pytest.mark.slow
def test_a_lag_of_the_drive_is_named_though_the_sensed_torque_has_it(tmp_path):
    lagging = {"senses_torque": True, "torque": behind_a_lag()}
    dataclasses.replace(AROUND_TORQUE, options=lagging).write(tmp_path, logs=3)
    first = gap.diagnose(read(tmp_path)).to_dict()["effects"][0]
    assert first["effect"] == "actuator_lag"
    assert first["parameters"]["lag"]["value"][0] == pytest.approx(LAG, rel=0.1)
