"""Logs of reference and position alone: the loop is identified, and its lag is no delay."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from tests.gap.scenarios.mujoco_joint import chirp, pick_and_place, record_of, robot_of, run

pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow

LATE = {"time_delay", "velocity_estimate_lag", "actuator_lag", "setpoint_delay", "in_loop_delay"}
GO2 = {"kp": 20.0, "kd": 1.5}  # Kd over Kp is 75 ms
STATED = Controller(law="pd", kp=[20.0], kd=[1.5], velocity_filter="difference", sample_time=1e-3)


def leg(robot, **joint):
    return [record_of(run(chirp(6.0, size=size), **GO2, mass=0.2, com=0.1, seed=seed, **joint),
                      robot, "qd", name=f"log-{seed}") for seed, size in enumerate((0.3, 0.2))]


def late_names(answer, least=0.5):
    return {row["effect"] for row in answer["effects"]
            if row["effect"] in LATE and row["probability"] >= least}


@pytest.mark.parametrize("law", [STATED, None], ids=["stated", "unknown"])
def test_the_lag_of_a_pd_law_is_no_delay(law):
    robot = robot_of(law)
    logs = leg(robot)
    follows = logs[0].time[np.argmax(np.correlate(logs[0].q[:, 0], logs[0].qd[:, 0], "full"))
                           - len(logs[0]) + 1]
    assert 0.04 < follows < 0.12  # s: the motion does trail its reference
    answer = diagnose(Problem.from_logs(robot, logs)).to_dict()
    assert late_names(answer) == set()
    first = answer["effects"][0]  # the weight, which neither file states
    assert first["effect"] == "gravity" and first["probability"] > 0.9
    weight = 0.2 * 9.81 * 0.1 * (1.0 if law else 1.0 / GO2["kp"])  # over the gain, if unknown
    assert first["parameters"]["along"]["value"] == pytest.approx(weight, rel=0.02)
    said = " ".join(answer["log_decisions"])
    assert ("That this law ran cannot be checked" if law else "over the gain of the servo") in said


def test_the_lag_of_the_go2_is_no_delay(shared):
    rows = np.genfromtxt(shared / "data" / "go2" / "traj_0.csv.gz", delimiter=",", skip_header=1)
    robot = robot_of(dataclasses.replace(STATED, sample_time=0.005, saturation=[45.4]))
    calf = Record(time=rows[:, 0], q=rows[:, [3]], qd=rows[:, [15]], robot=robot, source="go2")
    follows = np.argmax(np.correlate(*(x[:, 0] - x[:, 0].mean() for x in (calf.q, calf.qd)),
                                     "full")) - len(calf) + 1
    assert 0.05 < 0.005 * follows < 0.12  # s
    answer = diagnose(Problem.from_logs(robot, [calf]), effects=(
        *sorted(LATE), "coulomb", "stribeck", "spring", "gravity", "backlash")).to_dict()
    print(answer["verdict"], answer["set_90"])
    assert late_names(answer, least=0.05) == set()
    assert answer["families"]["friction"] > 0.5 or answer["verdict"] == "unexplained"


def test_a_late_servo_is_late_even_where_no_torque_is_logged():
    robot = robot_of()
    logs = [record_of(run(pick_and_place(8.0, seed, rest=0.4, move=0.1), **GO2, mass=0.2, com=0.1,
                          late=40, every=20, coulomb=0.15, seed=seed), robot, "qd",
                      name=f"log-{seed}") for seed in range(2)]
    answer = diagnose(Problem.from_logs(robot, logs),
                      effects=("time_delay", "coulomb", "gravity")).to_dict()
    assert answer["effects"][0]["effect"] == "time_delay"
    (delay,) = answer["effects"][0]["parameters"]["delay"]["value"]
    assert delay == pytest.approx(0.04, abs=0.012)
