"""Did the stated law run: the residual of the commands, and what rounding explains of it."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records.checks import check_record
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.law_residual import law_residual, rounding_limit
from clie_blocks.analysis.records.read import read_records
from clie_blocks.analysis.records.replay import is_in_step

STEP = 1e-3
LAW = control_law(Controller(kp=[10.0, 8.0], kd=[5.0, 3.0], highpass=200.0, lowpass=300.0,
                             discretisation="tustin"), STEP)
RANDOM = np.random.default_rng(3)
Q = np.cumsum(1e-3 * RANDOM.standard_normal((4000, 2)), axis=0)
QD = np.zeros_like(Q)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_law_that_ran_leaves_nothing_at_its_delay_alone(delay):
    u = LAW.replay(Q, QD, 0.0)
    sent = np.concatenate([np.zeros((delay, 2)), u[:len(u) - delay]])
    left = law_residual(LAW, sent, QD - Q, LAW.rate(Q), 0.0, delay)
    assert left.shape == (len(Q) - delay, 2)
    assert not left.any()
    assert np.std(law_residual(LAW, sent, QD - Q, LAW.rate(Q), 0.0, delay + 1)) > 0.1 * np.std(u)


def test_a_stated_step_of_the_command_alone_decides():
    u = LAW.replay(Q, QD, 0.0)
    step = np.array([0.01, 0.0])
    rounded = np.where(step > 0, np.round(u / np.where(step > 0, step, 1)) * step, u)
    limit = rounding_limit(u, step)
    np.testing.assert_allclose(limit, [0.005, 1e-3 * np.sqrt(np.mean(u[:, 1] ** 2))])
    assert 0.5 * limit[0] < np.std(rounded - u, axis=0)[0] < limit[0]
    np.testing.assert_array_equal(rounding_limit(u, step, np.array([1.0, 0.0])), limit)


def test_rounding_of_the_position_reaches_the_command_with_the_gain_of_the_law():
    step = 1e-5
    u = LAW.replay(Q, QD, 0.0)
    left = law_residual(LAW, u, QD - np.round(Q / step) * step,
                        LAW.rate(np.round(Q / step) * step), 0.0)
    rounding = np.std(left[100:], axis=0)
    np.testing.assert_allclose(rounding, step / np.sqrt(12) * LAW.position_gain(), rtol=0.05)
    limit = rounding_limit(u, np.zeros(2), step * LAW.position_gain())
    assert (rounding < limit).all() and (limit < 2 * rounding).all()


def test_a_measured_velocity_does_not_pass_on_the_rounding_of_the_position():
    exact = dataclasses.replace(LAW, variant="exact")
    np.testing.assert_allclose(exact.position_gain(), LAW.kp)


def test_a_coarse_position_does_not_excuse_a_large_residual():
    u = LAW.replay(Q, QD, 0.0)
    size = np.sqrt(np.mean(u**2, axis=0))
    np.testing.assert_allclose(rounding_limit(u, np.zeros(2), 1e3 * size), 0.01 * size)


def test_emps_is_explained_by_one_step_of_its_encoder(shared):
    for record in read_records(shared / "data/emps"):
        assert is_in_step(record, record.robot.controller)
        assert check_record(record) == []
        unknown = dataclasses.replace(record.robot, encoder=type(record.robot.encoder)())
        assert [f.check for f in check_record(record, unknown)] == ["law.residual"]


def test_a_servo_logged_by_its_host_is_not_in_step_and_its_law_is_not_proved(shared):
    records = read_records(shared / "data/bam_xl330")
    for record in records:
        assert not is_in_step(record, record.robot.controller)
        found = [f for f in check_record(record) if f.check == "law.residual"]
        assert [f.severity for f in found] == ["warning"]
        assert "not in step with the controller" in found[0].why
