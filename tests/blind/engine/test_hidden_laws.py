"""Faults of controller, sensor and log: the log against the stated law, replayed by scipy."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.blind.engine.controller import SetPoint, filter_coefficients
from clie_blocks.analysis.blind.engine.exporter import logged_command
from clie_blocks.analysis.blind.engine.parameters import G


def moving(joint, seconds=1.0):
    still = joint.experiment(seconds)
    wave = 0.2 * np.sin(5 * joint.robot.period * np.arange(len(still.q_d)))[:, None]
    return dataclasses.replace(still, q_d=still.q_d + wave)


def velocity(robot, x):
    b, a = filter_coefficients(*robot.corners, robot.period, robot.discretisation)
    return lfilter(np.ravel(b), np.ravel(a), x - x[0], axis=0)


def shifted(x, rows):
    return np.concatenate([np.repeat(x[:1], rows, axis=0), x[:len(x) - rows]])


LAWS = {  # what the log should show instead of the stated law, from set-point and angle
    "kp_factor": (1.2, lambda r, q_d, q: 1.2 * r.kp * (q_d - q) - r.kd * velocity(r, q)),
    "kd_factor": (0.7, lambda r, q_d, q: r.kp * (q_d - q) - 0.7 * r.kd * velocity(r, q)),
    "reference_speed": (1.0, lambda r, q_d, q: r.kp * (q_d - q) + r.kd * velocity(r, q_d - q)),
    "stale": (3e-3, lambda r, q_d, q: (r.kp * (q_d - shifted(q, 3))
                                       - r.kd * velocity(r, shifted(q, 3)))),
    "reference_delay": (4e-3, lambda r, q_d, q: (r.kp * (shifted(q_d, 4) - q)
                                                 - r.kd * velocity(r, q))),
    "estimate_lag": (5e-3, lambda r, q_d, q: r.kp * (q_d - q) - r.kd * lfilter(
        [1 - np.exp(-r.period / 5e-3)], [1, -np.exp(-r.period / 5e-3)], velocity(r, q), axis=0)),
    "compensated_weight": (0.3, lambda r, q_d, q: (r.kp * (q_d - q) - r.kd * velocity(r, q)
                                                   + 0.3 * np.cos(q))),
    "compensated_friction": (0.02, lambda r, q_d, q: (
        r.kp * (q_d - q) - r.kd * velocity(r, q) + 0.02 * np.tanh(velocity(r, q))))}


@pytest.mark.parametrize("key", LAWS)
def test_the_command_follows_another_law_than_the_stated_one(quiet_robot, key):
    joint = quiet_robot()
    value, law = LAWS[key]
    experiment = moving(joint)
    q, u = joint.run(experiment, **{key: value})
    stated = (joint.robot.kp * (experiment.q_d - q)
              - joint.robot.kd * velocity(joint.robot, q))
    assert u == pytest.approx(law(joint.robot, experiment.q_d, q), abs=1e-9 * joint.robot.kp[0])
    assert np.max(np.abs(u - stated)) > 1e-3 * joint.robot.kp[0]


def test_a_late_set_point_shifts_the_motion_and_nothing_else(quiet_robot):
    joint = quiet_robot()
    late, prompt = (joint.run(moving(joint), reference_delay=delay)[0] for delay in (0.02, 0.0))
    assert late == pytest.approx(shifted(prompt, 20), abs=1e-9)


def test_a_limited_set_point_never_moves_faster_than_its_limit(one_lane):
    limiter = SetPoint(1e-3, one_lane(slew=2.0))
    steps = np.repeat([0.0, 0.3, -0.2], 400)
    seen = np.array([limiter(np.full((1, 1), x))[0, 0] for x in steps])
    assert np.abs(np.diff(seen)).max() == pytest.approx(2e-3)
    assert seen[[399, 799, 1199]] == pytest.approx([0.0, 0.3, -0.2])
    assert np.sum(np.diff(seen[400:800]) > 1e-9) == pytest.approx(150, abs=1)


def test_an_encoder_off_zero_is_seen_only_through_the_weight(quiet_robot):
    for gravity in (False, True):
        joint = quiet_robot(gravity=gravity)
        (off, _), (true, _) = (joint.run(moving(joint, 4.0), zero=zero) for zero in (0.03, 0.0))
        assert (np.max(np.abs(off - true)) > 1e-4) == gravity
    robot, still = joint.robot, joint.experiment(6.0)
    off = joint.run(still, zero=0.03)[0][-1, 0]
    weight = robot.mass[0] * G * robot.com[0] * np.cos(off - 0.03)
    assert robot.kp[0] * robot.ratio[0] * (robot.pose[0] - off) == pytest.approx(weight, rel=1e-3)


def test_an_encoder_that_loses_counts_jumps_and_the_loop_takes_it_back(quiet_robot):
    joint = quiet_robot()
    q, _ = joint.run(joint.experiment(6.0), lost_counts=0.01)
    jumps = np.abs(np.diff(q[:, 0]))
    assert 1 <= np.sum(jumps > 5e-3) <= 6
    assert jumps.max() == pytest.approx(0.01, rel=0.05)
    assert np.median(np.abs(q - joint.robot.pose)) < 2e-3


def test_an_exporter_shifts_and_scales_the_command_alone(one_lane):
    u = np.random.default_rng(1).standard_normal((50, 2))
    p = {key: value[0] for key, value in one_lane(2).items()}
    assert np.array_equal(logged_command(u, 1e-3, p), u)
    p["skew"], p["logged_gain"] = np.array([2.4e-3, 0.0]), np.array([1.0, 1.1])
    found = logged_command(u, 1e-3, p)
    assert np.array_equal(found[:, 0], shifted(u[:, :1], 3)[:, 0])  # held from its own instant
    assert found[:, 1] == pytest.approx(1.1 * u[:, 1])
