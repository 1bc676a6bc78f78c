"""A joint in MuJoCo whose measured torque was logged late, or behind a low-pass."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from scenarios.mujoco_joint import PERIOD, chirp, pick_and_place, record_of, robot_of, run  # noqa: E402

from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.records.robot_sections import Links, Nominal  # noqa: E402

LATE, LOW_PASS = "late", "low-pass"
EVERY, KP, KD, COULOMB = 2, 30.0, 0.8, 0.08
SAMPLE = EVERY * PERIOD
LINKS = Links(mass=[0.3], com=[0.2], inertia=[0.0], length=[0.4])
REFERENCES = (chirp(12.0), chirp(12.0, size=0.2, high=4.0), pick_and_place(12.0, 3, rest=0.5))


def logs(coulomb):
    return [run(reference, KP, KD, coulomb=coulomb, every=1, noise=5e-5, seed=j)
            for j, reference in enumerate(REFERENCES)]


def late(torque, seconds):
    time = PERIOD * np.arange(len(torque))
    return np.interp(time - seconds, time, torque)


def low_passed(torque, seconds):
    share, passed = 1.0 - np.exp(-PERIOD / seconds), np.empty_like(torque)
    state = torque[0]
    for k, value in enumerate(torque):
        state += share * (value - state)
        passed[k] = state
    return passed


CHANNELS = {LATE: late, LOW_PASS: low_passed}


def diagnosed(rows, kind=LATE, seconds=0.0, every=EVERY):
    """Diagnosis of logs of torque and position, where the torque is a little rounded."""
    robot = dataclasses.replace(robot_of(links=LINKS, inertia=0.01, viscous_friction=[0.02]),
                                nominal=Nominal(gravity=True))
    records = []
    for j, log in enumerate(rows):
        torque = np.round(CHANNELS[kind](log[:, 3], seconds), 4) if seconds else log[:, 3]
        rows_of_log = np.column_stack([log[:, :3], torque, log[:, 4]])[::every]
        records.append(record_of(rows_of_log, robot, "tau", name=f"log {j}"))
    return gap.diagnose(gap.Problem.from_logs(robot, records, trust_logs=True))


@pytest.fixture(scope="module")
def sound():
    return logs(0.0)


@pytest.fixture(scope="module")
def rubbing():
    return logs(COULOMB)


@pytest.mark.slow
@pytest.mark.parametrize("kind, seconds", [(LATE, 8e-3), (LATE, -6e-3), (LOW_PASS, 8e-3)])
def test_a_torque_out_of_step_accuses_no_joint(sound, kind, seconds):
    found = diagnosed(sound, kind, seconds)
    lag = found.controller.torque_lag
    assert found.ranking[0].names == ("none",) and found.ranking[0].probability > 0.9
    names = {row["effect"] for row in found.to_dict()["effects"] if row["probability"] >= 0.5}
    assert ("channel_skew" in names) == (kind == LATE and seconds > 0.0)
    assert (lag.time_constant > 0.0) == (kind == LOW_PASS)
    assert abs(lag.seconds - seconds) < SAMPLE / 2
    assert f"Corrected in the logs: {lag.correction}" in str(found)


@pytest.mark.slow
@pytest.mark.parametrize("kind, seconds", [(LATE, 8e-3), (LATE, -6e-3), (LOW_PASS, 8e-3)])
def test_friction_is_found_beside_a_torque_out_of_step(rubbing, kind, seconds):
    found = diagnosed(rubbing, kind, seconds)
    assert found.ranking[0].names == ("coulomb",)
    assert abs(found.controller.torque_lag.seconds - seconds) < SAMPLE / 2
    row = next(row for row in found.to_dict()["effects"] if row["effect"] == "coulomb")
    assert row["parameters"]["level"]["value"] == pytest.approx([COULOMB], rel=0.1)


@pytest.mark.slow
def test_a_low_pass_shows_beside_friction_that_no_smooth_torque_is_like():
    found = diagnosed(logs(0.12), LOW_PASS, 6e-3)
    assert found.controller.torque_lag.time_constant == pytest.approx(6e-3, abs=SAMPLE / 4)
    assert "coulomb" in found.to_dict()["set_90"]


@pytest.mark.slow
@pytest.mark.parametrize("every", [10, 20])
def test_a_torque_goes_on_between_slow_rows(sound, every):
    """Held over them it would be late by half of their step."""
    of_sound, of_friction = (diagnosed(rows, every=every) for rows in (sound, logs(0.2)))
    assert of_sound.problem.period <= 2.5e-3
    assert of_sound.ranking[0].names == ("none",) and of_sound.ranking[0].probability > 0.9
    answer = of_friction.to_dict()
    assert "coulomb" in answer["set_90"]
    assert {row["effect"] for row in answer["effects"] if row["probability"] >= 0.5} <= {"coulomb"}


@pytest.mark.slow
def test_a_torque_in_step_is_left_as_it_is(sound, rubbing):
    for rows in (sound, rubbing):
        assert diagnosed(rows).controller.torque_lag is None
