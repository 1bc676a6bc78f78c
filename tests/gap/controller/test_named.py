"""Effects of the catalogue that show in the commands: found by name, in a log of another route.

The commands are made sample by sample, as a controller makes them, with loops of their own.
"""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.controller.misrecorded import OF_LOG, OF_ROBOT, with_reading
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.verdict.signal_findings import controller_findings

JOINT = 1  # which has the effect; the others are as stated
FAST = 2000  # samples of each log


@pytest.fixture(scope="module")
def robot(healthy):
    """The healthy robot with short logs, and a reference that steps and moves in the first."""
    def short(log):
        time = healthy.period * np.arange(FAST)[:, None]
        steps = 0.4 * (np.floor(2.5 * time) % 2) + 0.2 * np.sin(7.0 * time)
        q_d = log.q_d[:FAST] + (steps if np.ptp(log.q_d) else 0.0)
        return dataclasses.replace(log, q_d=q_d, **{
            name: getattr(log, name)[:FAST] for name in ("q", "u", "pe", "dither")})
    return healthy.with_logs(short)


def commanded(problem, change, joint=JOINT):
    """The same motions, with rounded commands of which those of a joint are changed."""
    law = problem.law

    def rounded(log):
        u = law.replay(log.q, log.q_d, log.pe)
        u[:, joint] = change(log, law)[:, joint]
        return dataclasses.replace(log, u=np.round(u / law.resolution) * law.resolution)
    return problem.with_logs(rounded)


def findings(problem, left_out=()):
    return controller_findings(check_controller(problem), VerdictMethod(), left_out)


def late(x, samples):
    """Signal so many samples late, at rest before its start, linear between samples."""
    index = np.arange(len(x))
    return np.stack([np.interp(index - samples, index, column) for column in x.T], axis=1)


def slewed(q_d, most):
    out = q_d.copy()
    for k in range(1, len(out)):
        out[k] = out[k - 1] + np.clip(q_d[k] - out[k - 1], -most, most)
    return out


def averaged(x, share):
    """Moving average of exponential weights, as drives filter a velocity."""
    out = np.zeros_like(x)
    for k in range(1, len(x)):
        out[k] = out[k - 1] + share * (x[k] - out[k - 1])
    return out


def integrated(log, law, gain, clamp):
    """Torque of an integral that holds the present sample, and stops beyond its clamp."""
    out, z = np.zeros_like(log.q), np.zeros(log.q.shape[1])
    for k, error in enumerate(log.q_d - log.q):
        outward = (np.abs(gain * z) >= clamp) & (np.sign(z) == np.sign(error))
        z = z + law.period * error * ~outward
        out[k] = np.clip(gain * z, -clamp, clamp)
    return out


def derivative(q_d, corner, period):
    """Rate of the reference behind a corner."""
    return np.diff(averaged(q_d - q_d[0], 1 - np.exp(-corner * period)), axis=0,
                   prepend=np.zeros((1, q_d.shape[1]))) / period


def law_of(log, law, **changed):
    """Command of the law with other signals than the logged ones."""
    signals = {"q_d": log.q_d, "q": log.q, "dq": law.rate(log.q), "pe": log.pe, **changed}
    return law.command(signals["q_d"] - signals["q"], signals["dq"], signals["pe"])


EFFECTS = {
    "gain_error": (lambda log, law: law_of(log, dataclasses.replace(law, kp=1.1 * law.kp,
                                                                    kd=0.8 * law.kd)),
                   {"kp_error": 0.1, "kd_error": -0.2}),
    "control_law_form": (lambda log, law: law_of(
        log, law, dq=law.rate(log.q) - 0.7 * derivative(log.q_d, 60.0, law.period)),
        {"share": 0.7, "corner": 60.0}),
    "hidden_integral": (lambda log, law: law_of(log, law) + integrated(
        log, law, 2.0 * law.kp, np.inf), {"ki": 2.0}),
    "hidden_compensation": (lambda log, law: law_of(log, law) + law.kp * (
        0.1 * np.cos(log.q) + 0.02 * np.tanh(law.rate(log.q) / 0.05)),
        {"weight": 0.1, "friction": 0.02, "width": 0.05}),
    "setpoint_slew": (lambda log, law: law_of(log, law, q_d=slewed(log.q_d, 2.5 * law.period)),
                      {"speed": 2.5}),
    "setpoint_delay": (lambda log, law: law_of(log, law, q_d=late(log.q_d, 13.4)),
                       {"delay": 13.4e-3}),
    "in_loop_delay": (lambda log, law: law_of(log, law, q=late(log.q, 4.0),
                                              dq=late(law.rate(log.q), 4.0)), {"delay": 4e-3}),
    "velocity_estimate_lag": (lambda log, law: law_of(log, law, dq=averaged(
        law.rate(log.q), 1 - np.exp(-law.period / 6e-3))), {"lag": 6e-3}),
    "channel_skew": (lambda log, law: late(law_of(log, law), 2.6), {"skew": 2.6e-3}),
    "sensor_gain": (lambda log, law: 1.05 * law_of(log, law) + 0.01 * law.kp,
                    {"error": 0.05, "bias": 0.01}),
}
PER_KP = ("ki", "weight", "friction", "bias")


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_what_shows_in_the_command_is_named_with_its_parameters(name, robot):
    change, truth = EFFECTS[name]
    (found,) = findings(commanded(robot, change))
    assert (found.effect, found.joints, found.alike) == (name, (JOINT,), ())
    assert set(found.parameters) == set(truth)
    for key, entry in found.parameters.items():
        (low,), (high,) = entry["interval"]
        true = truth[key] * (robot.law.kp[JOINT] if key in PER_KP else 1.0)
        assert low <= true <= high and high - low < 0.5 * abs(true), key
    assert findings(commanded(robot, change), {name}) == ()


@pytest.mark.slow
def test_a_clamped_integral_is_named_with_its_clamp(robot):
    def clamped(log, law):
        return law_of(log, law) + integrated(log, law, 4.0 * law.kp, 0.03 * law.kp)
    (found,) = findings(commanded(robot, clamped))
    kp = robot.law.kp[JOINT]
    assert found.effect == "hidden_integral"
    for key, true in (("ki", 4.0 * kp), ("clamp", 0.03 * kp)):
        (low,), (high,) = found.parameters[key]["interval"]
        assert low <= true <= high


def test_the_law_that_ran_shows_no_effect(robot):
    assert findings(commanded(robot, law_of)) == ()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coulomb", "actuator_lag", "time_delay", "torque_gain_error",
                                  "encoder_eccentricity", "spring"])
def test_a_fault_of_the_robot_is_none_of_the_controller(name, case):
    from clie_blocks.analysis.gap.problem.problem import Problem

    made = case(name)
    check = check_controller(Problem.from_logs(made.robot, made.records))
    assert check.as_stated and not check.named


@pytest.mark.slow
def test_a_lag_of_the_velocity_is_a_filter_by_another_name_where_none_is_stated(robot):
    law = robot.law.with_filter(slice(None), "difference", None)
    plain = dataclasses.replace(robot, law=dataclasses.replace(law, corners=None))
    (found,) = findings(commanded(plain, EFFECTS["velocity_estimate_lag"][0]))
    assert found.effect == "velocity_estimate_lag"
    assert found.as_dict()["alike"] == ["velocity_filter_mismatch"]
    (other,) = findings(commanded(plain, EFFECTS["velocity_estimate_lag"][0]),
                        {"velocity_estimate_lag"})
    assert other.effect == "velocity_filter_mismatch" and not other.alike


@pytest.mark.slow
def test_joints_with_one_name_are_one_finding_and_models_go_on_with_what_ran(robot):
    change = EFFECTS["setpoint_delay"][0]
    check = check_controller(commanded(robot, change, slice(None)))
    assert [one.joint for one in check.named] == list(range(robot.n))
    (found,) = controller_findings(check, VerdictMethod())
    assert found.joints == tuple(range(robot.n))
    assert len(found.parameters["delay"]["value"]) == robot.n
    problem = commanded(robot, change, slice(None))
    for log, stated in zip(check.corrected(problem).logs, problem.logs, strict=True):
        np.testing.assert_allclose(robot.law.replay(log.q, log.q_d, log.pe), stated.u, atol=1e-9)


@pytest.mark.slow
def test_a_late_command_is_late_in_the_log_or_on_the_robot(robot):
    problem = commanded(robot, EFFECTS["channel_skew"][0])
    check = check_controller(problem)
    of_log, of_robot, open_ = (with_reading(check, problem, order) for order in (
        (OF_LOG,), (OF_ROBOT,), (OF_ROBOT, OF_LOG)))
    assert [one.names for one in of_log.named] == [("channel_skew",)]
    assert [one.names for one in of_robot.named] == [("time_delay",)]
    assert open_.named[0].names == ("time_delay", "channel_skew")
    assert "does not tell" in open_.differences[-1]
    stated = robot.law.replay(*(getattr(problem.logs[0], name) for name in ("q", "q_d", "pe")))
    np.testing.assert_allclose(of_log.corrected(problem).logs[0].u[:, JOINT], stated[:, JOINT])
    driven = of_robot.corrected(problem).logs[0]
    np.testing.assert_allclose(robot.law.replay(driven.q, driven.q_d, driven.pe)[:, JOINT],
                               problem.logs[0].u[:, JOINT], atol=1e-9)
