"""Noise that only the log holds: what the controller read follows from its commands."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.corrections import examine
from clie_blocks.analysis.records.read_positions import read_positions

STEP = 1e-3
NOISE = 4e-3  # rad, twenty times that of the sensor


def noisy(record, size=NOISE, seed=0):
    """Log of a position with further noise, which the controller did not read."""
    noise = np.random.default_rng(seed).normal(0.0, size, record.q.shape)
    return record.replace(q=record.q + noise)


def with_law(record, controller, k=slice(None)):
    """Log of the same motion with the commands of another controller at the joints k."""
    u = record.u.copy()
    law = control_law(controller, STEP)
    u[:, k] = (np.round(law.replay(record.q, record.qd, record.pe) / 1e-3) * 1e-3)[:, k]
    return record.replace(u=u)


@pytest.mark.parametrize("discretisation", ["tustin", "zoh", "backward"])
def test_the_position_that_the_controller_read_is_found(clean, robot, discretisation):
    controller = dataclasses.replace(robot.controller, discretisation=discretisation)
    log = with_law(clean, controller)
    for k in range(3):
        read = read_positions([noisy(log)], controller, k)
        assert read.corners is None
        assert read.noise == pytest.approx(NOISE, rel=0.05)
        assert np.sqrt(np.mean((read.q[0] - clean.q[:, k]) ** 2)) < 5e-5


def test_other_corners_are_found_through_the_noise(clean, robot):
    other = dataclasses.replace(robot.controller, highpass=100.0, lowpass=160.0)
    log = noisy(with_law(clean, other, 1))
    assert read_positions([log], robot.controller, 0).corners is None
    read = read_positions([log], robot.controller, 1)
    delay = sum(1.0 / corner for corner in read.corners)  # which the motion shows best
    assert delay == pytest.approx(1 / 100.0 + 1 / 160.0, rel=0.02)
    assert np.sqrt(np.mean((read.q[0] - clean.q[:, 1]) ** 2)) < NOISE / 20


def with_integral(record, controller):
    return record.replace(u=record.u + 2.0 * np.cumsum(record.qd - record.q, axis=0))


def with_lost_white_excitation(record, controller):
    """The controller's law is not replayed, and the logged position holds no further noise."""
    lost = np.random.default_rng(1).normal(0.0, 1.0, record.u.shape)
    return record.replace(u=record.u + lost, q=record.q)


@pytest.mark.parametrize("damaged", [
    lambda log, law: noisy(with_law(log, dataclasses.replace(law, kp=1.1 * law.kp))),
    lambda log, law: noisy(with_law(log, dataclasses.replace(law, kd=1.1 * law.kd))),
    lambda log, law: noisy(with_integral(log, law)),
    lambda log, law: noisy(log.replace(pe=None)), with_lost_white_excitation])
def test_another_law_is_no_noise(clean, robot, damaged):
    log = damaged(clean, robot.controller)
    assert all(read_positions([log], robot.controller, k) is None for k in range(3))


def test_noise_that_the_controller_read_stays(clean, robot):
    assert all(read_positions([clean], robot.controller, k) is None for k in range(3))


def test_noise_of_the_log_alone_is_corrected_and_said(clean, robot):
    log = clean.replace(tau=None, dq=None)
    seen = examine([noisy(log.part(0, 6000)), noisy(log.part(6000, 12_000), seed=1)], robot)
    assert seen.corrections == ()  # the second log begins in motion, in a state that is not known
    seen = examine([noisy(log)], robot)
    (correction,) = seen.corrections
    assert correction.check == "position.noise" and correction.joints == robot.joints
    assert "did not read" in correction.what and "white noise" in correction.why
    assert np.sqrt(np.mean((seen.records[0].q - clean.q) ** 2)) < 5e-5
    assert "law.residual" not in {finding.check for finding in seen.warnings}
