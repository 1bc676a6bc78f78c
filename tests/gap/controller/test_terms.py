"""Commands that the stated law does not give: known terms, and models that follow them."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.controller.terms import command_beyond_law, with_recorded_commands


def commanded(problem, change):
    """The same motions, with commands to which a function of log and law adds something."""
    return problem.with_logs(lambda log: dataclasses.replace(
        log, u=problem.law.replay(log.q, log.q_d, log.pe) + change(log, problem.law)))


@pytest.fixture
def moving(healthy):
    """The healthy robot under a reference that moves."""
    time = healthy.period * np.arange(len(healthy.logs[0]))
    return healthy.with_logs(lambda log: dataclasses.replace(
        log, q_d=log.q_d[:1] + 0.3 * np.sin(2.0 * time[:len(log), None])))


@pytest.mark.slow
def test_a_law_on_the_velocity_error_of_its_own_filter_is_named_as_a_form(moving):
    check = check_controller(commanded(moving, lambda log, law: law.kd * law.rate(log.q_d)))
    assert not check.as_stated and check.misdescribed and not (check.unexplained or check.terms)
    assert {one.names for one in check.named} == {("control_law_form",)}
    for one in check.named:
        assert one.found[0].values["share"] == pytest.approx(1.0, abs=0.02)
    assert "control law form (share 1" in check.decisions[0]


@pytest.mark.slow
def test_a_lead_by_the_acceleration_of_the_reference_is_a_term(moving):
    check = check_controller(commanded(moving, lambda log, law: 0.1 * law.kd * np.gradient(
        np.gradient(log.q_d, law.period, axis=0), law.period, axis=0)))
    assert not check.as_stated and not check.misdescribed and not check.unexplained
    assert [terms.joint for terms in check.terms] == list(range(moving.n))
    for terms, kd in zip(check.terms, moving.law.kd, strict=True):
        assert terms.coefficients == {
            "reference acceleration": pytest.approx(0.1 * kd, rel=0.02)}


@pytest.mark.slow
def test_a_constant_that_the_law_does_not_have_is_named(healthy):
    check = check_controller(commanded(healthy, lambda log, law: 0.1 + 0.0 * log.q))
    assert all(terms.coefficients == {"constant": pytest.approx(0.1, rel=1e-2)}
               for terms in check.terms) and len(check.terms) == healthy.n


@pytest.mark.slow
def test_what_no_law_gives_is_unexplained_and_no_velocity_filter_is_blamed(healthy):
    rng = np.random.default_rng(0)
    check = check_controller(commanded(healthy, lambda log, law: 0.2 * np.abs(
        np.cumsum(rng.normal(0, 0.01, log.q.shape), axis=0))))
    assert check.unexplained == tuple(range(healthy.n))
    assert not (check.other_filter or check.other_gains or check.terms or check.as_stated)


def test_models_that_follow_the_record_get_the_recorded_command(healthy):
    lost = commanded(healthy, lambda log, law: 0.2 * np.sin(np.arange(len(log)) / 300.0)[:, None])
    followed = with_recorded_commands(lost, range(healthy.n))
    for log in followed.logs:
        np.testing.assert_allclose(healthy.law.replay(log.q, log.q_d, log.pe), log.u, atol=1e-9)


def test_a_command_at_its_limit_holds_nothing_beyond_the_law(healthy):
    limit = 0.3 * np.max([np.abs(log.u).max(axis=0) for log in healthy.logs], axis=0)
    law = dataclasses.replace(healthy.law, saturation=limit)
    logs = commanded(dataclasses.replace(healthy, law=law), lambda log, law: 0.0).logs
    assert any(np.any(np.abs(log.u) >= limit) for log in logs)
    for log in logs:
        np.testing.assert_allclose(command_beyond_law(law, log), 0.0, atol=1e-12)


def test_what_a_drive_does_cannot_show_in_a_measured_torque(healthy):
    measured = dataclasses.replace(healthy.law, measured_torque=True)
    lost = {cause.name for cause in CAUSES
            if healthy.law.reaches(cause) and not measured.reaches(cause)}
    assert lost == {"dead_zone", "actuator_saturation", "actuator_lag", "time_delay",
                    "torque_gain_error", "torque_speed_limit", "supply_sag", "motor_heating",
                    "commutation_ripple", "torque_quantization", "torque_slew", "tick_jitter",
                    "packet_hold"}
