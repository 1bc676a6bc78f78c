"""What the command path shows: delayed set-points, coarse positions, late and weak torques."""

import dataclasses

import numpy as np
import pytest
from factories import make_check, make_problem, make_residual_model

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.method.calibration import load_calibration
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem.position_path import servo_response
from clie_blocks.analysis.gap.problem.preparation import prepare
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.torque_path import path_torque
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.verdict.set_point_findings import delay_probability
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding
from clie_blocks.analysis.gap.verdict.signal_findings import (
    controller_findings,
    signal_findings,
    with_signal_findings,
)
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller

PERIOD, STEP, SIGMA = 0.02, 1.5e-3, 5e-4


def findings(logs, left_out=frozenset(), resolution=0.0, sigma=SIGMA, step=0.0):
    n = logs[0].n
    residuals = make_residual_model(make_problem(n=n, resolution=resolution), sigma)
    return signal_findings(logs, residuals, make_check(n, step), left_out)


def servo_logs(delay, level):
    """Two logs of a servo, as the diagnosis gets them."""
    rng, robot = np.random.default_rng(7), Robot(
        n=1, controller=Controller(law="unknown", sample_time=PERIOD))
    records = []
    for _ in range(2):
        goal = np.repeat(rng.uniform(-0.5, 0.5, 20), 40)
        q = servo_response(goal, goal[0], PERIOD, 25.0, 1.2, 0.0, delay, level)
        q = q + rng.normal(0, SIGMA, q.size)
        records.append(Record(time=PERIOD * np.arange(q.size), q=q[:, None], qd=goal[:, None],
                              robot=robot))
    return prepare(robot, records)[1]


def test_a_late_servo_that_sticks_is_late_first_of_all():
    (cause,) = findings(servo_logs(0.03, 0.01))
    assert cause.effect == "time_delay" and cause.joints == (0,) and cause.probability > 0.9
    low, high = np.ravel(cause.parameters["delay"]["interval"])
    assert low < 0.03 < high and high - low < 2e-3
    dead = cause.parameters["dead_time"]
    assert dead["value"][0] > 0.03 + PERIOD
    assert dead["interval"][0][0] <= dead["value"][0] - PERIOD + 1e-9
    assert cause.left["both"][0] < 0.5 * min(cause.left[name][0] for name in (
        "lag", "setpoint_delay", "coulomb"))
    assert 0.1 < cause.share < 0.9
    row = cause.as_dict()
    assert row["joint"] == [1] and row["parameters"]["delay"]["unit"] == "s"


def test_a_servo_that_only_sticks_is_not_late():
    assert findings(servo_logs(0.0, 0.01)) == ()


def test_goals_that_rest_tell_nothing():
    logs = [record.replace(qd=0 * record.qd, u=-record.q) for record in servo_logs(0.0, 0.01)]
    assert findings(logs) == ()


def test_steps_that_make_the_noise_are_named_unless_stated():
    logs = servo_logs(0.0, 0.01)
    (cause,) = findings(logs, step=STEP)
    assert cause.effect == "encoder_quantization"
    np.testing.assert_allclose(cause.parameters["step"]["value"], [STEP])
    assert findings(logs, resolution=STEP, step=STEP) == ()
    assert findings(logs, sigma=5 * SIGMA, step=STEP) == ()


def test_a_stated_law_says_nothing_of_paths(case):
    made = case("none")
    assert findings(made.records) == ()


def torque_logs(gain, lag, noise=0.01):
    rng, time = np.random.default_rng(8), 0.002 * np.arange(4000)
    robot = Robot(n=2, controller=Controller(law="unknown", sample_time=0.002))
    records = []
    for rate in (0.3, 0.5):
        u = np.stack([np.sin(2 * np.pi * (0.2 + rate * time) * time), 0 * time], 1)
        tau = np.stack([path_torque(u[:, 0], 0.002, gain, lag, 0.0, 0.0), 0 * time], 1)
        records.append(Record(time=time, q=np.cumsum(u, axis=0) * 1e-3, u=u,
                              tau=tau + rng.normal(0, noise, tau.shape), robot=robot))
    return prepare(robot, records)[1]


def test_a_late_and_weak_drive_is_told_with_intervals():
    late, weak = findings(torque_logs(0.8, 0.02))
    assert (late.effect, weak.effect) == ("actuator_lag", "torque_gain_error")
    for cause, name, truth in ((late, "lag", 0.02), (weak, "error", -0.2)):
        low, high = np.ravel(cause.parameters[name]["interval"])
        assert cause.joints == (0,)
        assert low - 1e-3 < truth < high + 1e-3 and high - low < 0.1 * abs(truth)


def test_a_drive_that_gives_what_is_asked_is_no_cause():
    assert findings(torque_logs(1.0, 0.0)) == ()
    assert findings(torque_logs(1.0, 0.0, noise=0.0)) == ()


def ramps(noise=0.05, junk=0.0, **path):
    """Two logs of a locked drive that is asked for ramps, with the torque that it gives."""
    rng, time = np.random.default_rng(0), 0.002 * np.arange(5000)
    robot = Robot(n=1, controller=Controller(law="unknown", sample_time=0.002))
    sound = {"gain": 1.0, "lag": 0.0, "delay": 0.0, "offset": 0.0}
    records = []
    for largest in (40.0, 50.0):
        u = largest * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * time / 5.0))
        tau = path_torque(u, 0.002, **(sound | path)) + rng.normal(0, noise, time.size)
        tau += junk * np.std(u) * np.sin(2.0 * np.pi * 0.37 * time + 1.0)
        records.append(Record(time=time, q=np.zeros((time.size, 1)), u=u[:, None],
                              tau=tau[:, None], robot=robot))
    return prepare(robot, records)[1]


def test_ramps_that_meet_a_limit_show_a_limit_and_no_gain():
    (limited,) = findings(ramps(limit=30.0))
    assert limited.effect == "actuator_saturation" and limited.probability > 0.9
    low, high = np.ravel(limited.parameters["limit"]["interval"])
    assert low - 1e-2 < 30.0 < high + 1e-2 and high - low < 0.1
    weak, limited = findings(ramps(limit=25.0, gain=0.8))
    assert (weak.effect, limited.effect) == ("torque_gain_error", "actuator_saturation")
    assert weak.parameters["error"]["value"][0] == pytest.approx(-0.2, abs=0.01)


def test_a_dead_zone_shows_in_the_measured_torque():
    (dead,) = findings(ramps(width=3.0))
    assert dead.effect == "dead_zone"
    assert dead.parameters["width"]["value"][0] == pytest.approx(3.0, abs=0.02)


def test_a_gain_is_not_named_where_most_is_something_else():
    (weak,) = findings(ramps(gain=0.81))
    assert weak.effect == "torque_gain_error" and weak.probability > 0.9
    assert findings(ramps(gain=0.81, junk=0.8)) == ()


def test_a_measured_torque_that_stands_for_the_command_is_compared_with_nothing():
    logs = [record.replace(robot=dataclasses.replace(
        record.robot, controller=dataclasses.replace(record.robot.controller,
                                                     u_is="measured")))
            for record in ramps(limit=30.0)]
    assert findings(logs) == ()


@pytest.mark.parametrize("left, late", [
    ({"lag": 200.0, "setpoint_delay": 0.3, "coulomb": 150.0, "both": 0.3}, True),
    ({"lag": 200.0, "setpoint_delay": 150.0, "coulomb": 0.3, "both": 0.3}, False),
    ({"lag": 200.0, "setpoint_delay": 190.0, "coulomb": 180.0, "both": 20.0}, True),
    ({"lag": 0.1, "setpoint_delay": 0.1, "coulomb": 0.1, "both": 0.1}, False)])
def test_a_delay_is_believed_where_it_is_needed(left, late):
    probability = delay_probability(left, load_calibration())
    assert probability > 0.9 if late else probability < 0.2


def test_what_the_path_shows_is_an_effect_though_the_motion_does_not_ask_for_one():
    found = (SignalFinding("time_delay", (0,), 0.9, {}),)
    for verdict, expected in (("none", "effect"), ("not_identifiable", "effect"),
                              ("unexplained", "unexplained")):
        assert with_signal_findings(verdict, found) == expected
    assert with_signal_findings("none", ()) == "none"


def test_what_is_left_out_is_not_named_and_explains_nothing():
    logs = servo_logs(0.03, 0.01)
    assert findings(logs, {"time_delay"}) == ()
    (cause,) = findings(logs, {"coulomb"})
    assert cause.effect == "time_delay" and set(cause.left) == {"lag", "setpoint_delay"}
    assert findings(servo_logs(0.0, 0.01), {"encoder_quantization"}, step=STEP) == ()


def test_a_late_torque_goes_to_the_cause_that_is_not_left_out():
    logs, lag = torque_logs(0.8, 0.02), {"actuator_lag"}
    late, weak = findings(logs, lag)
    assert (late.effect, weak.effect) == ("time_delay", "torque_gain_error")
    assert late.parameters["delay"]["value"][0] == pytest.approx(0.02, abs=1e-3)
    (weak,) = findings(logs, lag | {"time_delay"})
    assert weak.parameters["error"]["value"][0] == pytest.approx(-0.2, abs=0.01)
    (late,) = findings(logs, {"torque_gain_error"})
    assert late.effect == "actuator_lag"


def test_the_check_establishes_only_what_is_not_left_out():
    check = make_check(step=STEP, wrong=(0,), coarse=(0,))
    filter_, steps = controller_findings(check, VerdictMethod())
    assert (filter_.effect, steps.effect) == ("velocity_filter_mismatch", "encoder_quantization")
    assert filter_.as_dict()["parameters"]["lowpass"]["value"] == [300.0]
    (filter_,) = controller_findings(check, VerdictMethod(), {"encoder_quantization"})
    assert filter_.effect == "velocity_filter_mismatch"
    assert controller_findings(make_check(), VerdictMethod()) == ()


@pytest.mark.slow
@pytest.mark.parametrize("choice", [{"exclude": ("time_delay",)}, {"effects": ("coulomb",)}])
def test_a_delay_that_is_known_not_to_be_there_is_in_no_answer(choice):
    logs = servo_logs(0.03, 0.01)
    found = diagnose(Problem.from_logs(logs[0].robot, logs), **choice)
    said = answer(found)
    assert "time_delay" in found.excluded and found.findings == ()
    assert "time_delay" not in [row["effect"] for row in said["effects"]] + said["set_90"]
