"""Logs of normal work: rests, few seconds, one log, noise, coarse encoders.  No wrong name."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Encoder, Links, Nominal
from tests.gap.scenarios.mujoco_joint import pick_and_place, record_of, robot_of, run

pytest.importorskip("mujoco")

STATED = Controller(law="pd", kp=[30.0], kd=[2.0], velocity_filter="difference", sample_time=1e-3)
MEASURED = Controller(law="unknown", u_is="measured")
LINKS = Links(length=[0.4], mass=[0.3], com=[0.2], inertia=[0.0])
TWELVE_BITS = 2 * np.pi / 4096
HONEST = {"none", "unknown", "parametric", "encoder_quantization"}
DRY = {"coulomb", "asymmetric_coulomb", "stribeck", "presliding", "dahl", "maxwell_slip",
       "load_dependent_friction", "directional_efficiency", "rest_time_breakaway"}


def answered(law, *signals, seconds=12.0, rest=2.0, step=0.0, seed=1, **joint):
    """Answer on one log of pick and place."""
    robot = robot_of(law, LINKS, 0.01, viscous_friction=[0.02], inertia_tolerance=0.1,
                     viscous_friction_tolerance=0.2, torque_offset_tolerance=[0.05])
    robot = dataclasses.replace(robot, nominal=Nominal(gravity=True),
                                encoder=Encoder(resolution=[step]) if step else Encoder())
    rows = run(pick_and_place(seconds, seed, rest=rest), 30.0, 2.0, step=step, seed=seed, **joint)
    return diagnose(Problem.from_logs(robot, [record_of(rows, robot, *signals)]),
                    seconds=30.0).to_dict()


def wrong_names(answer, *truth):
    """Names with half the probability or more that are not there."""
    return {row["effect"] for row in answer["effects"]
            if row["probability"] >= 0.5} - HONEST - set(truth)


@pytest.mark.parametrize("poor", [
    {"noise": 4e-4}, {"step": TWELVE_BITS}, {"step": TWELVE_BITS, "signals": ("qd",)}],
    ids=["noise", "12 bits", "12 bits, no command"])
def test_a_sound_robot_is_accused_of_nothing(poor):
    poor = {"signals": ("qd", "u"), **poor}
    answer = answered(STATED, *poor.pop("signals"), **poor)
    assert not wrong_names(answer) and answer["verdict"] in ("none", "not_identifiable")
    hidden = {row["effect"]: row["why"] for row in answer["not_shown"]}
    assert "motor makes" in hidden["torque_ripple"]


@pytest.mark.slow
def test_a_drive_that_gives_less_may_be_a_payload_and_both_are_said():
    answer = answered(STATED, "qd", "u", gain=0.8, seed=6)
    assert not wrong_names(answer, "torque_gain_error")
    assert {"torque_gain_error", "payload"} <= set(answer["set_90"])


@pytest.mark.slow
@pytest.mark.parametrize("law, signals", [(STATED, ("qd", "u")), (MEASURED, ("u",))],
                         ids=["stated law", "measured torque"])
def test_five_seconds_show_friction_of_some_kind_and_nothing_else(law, signals):
    answer = answered(law, *signals, seconds=5.0, rest=0.8, coulomb=0.15, seed=2)
    assert not wrong_names(answer, *DRY)
    assert {"coulomb", "unknown"} & set(answer["set_90"])
    hidden = {row["effect"]: row["why"] for row in answer["not_shown"]}
    assert "longest log has 5 s" in hidden["friction_drift"]
