"""The control law replayed on a log: rounding alone remains when the stated law is the one."""

import control as ct
import numpy as np
import pytest
from scipy import signal

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.read import read_records
from clie_blocks.analysis.records.replay import replay, variants, velocity
from clie_blocks.errors import ClieError, NotIdentifiableError

STEP = 1e-3
PD = Controller(kp=[10.0, 8.0], kd=[5.0, 3.0], highpass=200.0, lowpass=300.0,
                discretisation="tustin", sample_time=STEP, command_resolution=[0.005, 0.01])
G1 = ct.tf([200.0 * 300.0, 0.0], [1.0, 500.0, 60000.0])


def motion(samples=3000):
    time = STEP * np.arange(samples)
    q = np.stack([0.4 * np.sin(5 * time) + 0.1, 0.2 * np.cos(9 * time)], axis=1)
    return time, q + 1e-4 * np.random.default_rng(0).standard_normal(q.shape)


def discretised(q, method):
    """Second route: scipy's discretisation and its recursion from rest at the first sample."""
    system = signal.cont2discrete((G1.num[0][0], G1.den[0][0]), STEP, method)
    return signal.lfilter(np.ravel(system[0]), system[1], q - q[0], axis=0)


def logged(method="bilinear", controller=PD):
    time, q = motion()
    qd = np.full_like(q, 0.1)
    pe = np.sin(time)[:, None] * [1.0, 0.5]
    u = controller.kp * (qd - q) - controller.kd * discretised(q, method) + pe
    u = np.round(u / controller.command_resolution) * controller.command_resolution
    return Record(time, q, u=u, qd=qd, pe=pe)


@pytest.mark.parametrize(("variant", "method"), [
    ("tustin", "bilinear"), ("zoh", "zoh"), ("backward", "backward_diff"), ("forward", "euler")])
def test_every_discretisation_of_g1_agrees_with_scipy(variant, method):
    record = logged()
    assert np.allclose(velocity(record, PD, variant), discretised(record.q, method), atol=1e-9)


def test_matched_filters_are_those_of_the_two_factors_in_turn():
    high, low = np.exp(-200.0 * STEP), np.exp(-300.0 * STEP)
    record = logged()
    fast = signal.lfilter([(1 - high) / STEP, -(1 - high) / STEP], [1.0, -high],
                          record.q - record.q[0], axis=0)
    assert np.allclose(velocity(record, PD, "matched"),
                       signal.lfilter([1 - low], [1.0, -low], fast, axis=0), atol=1e-9)


@pytest.mark.parametrize(("variant", "method"), [
    ("tustin", "bilinear"), ("zoh", "zoh"), ("backward", "backward_diff"), ("forward", "euler")])
def test_the_variant_that_ran_is_found_and_leaves_rounding_alone(variant, method):
    found = replay(logged(method), PD)
    assert found.variant == variant
    assert np.all(np.abs(found.residual) <= 0.5001 * PD.command_resolution)
    assert found.lsb == pytest.approx(1 / np.sqrt(12), rel=0.1)


def test_equal_corners_are_no_special_case():
    twin = Controller(kp=[1.0, 1.0], kd=[1.0, 1.0], highpass=250.0, lowpass=250.0)
    near = Controller(kp=[1.0, 1.0], kd=[1.0, 1.0], highpass=250.0, lowpass=250.0001)
    record = logged()
    assert np.allclose(velocity(record, twin, "zoh"), velocity(record, near, "zoh"), atol=1e-5)


def test_a_break_in_the_log_starts_the_filter_again_and_does_not_count():
    whole = logged()
    valid = np.ones(len(whole), bool)
    valid[1500:1510] = False
    q = whole.q.copy()
    q[1500:1510] = np.nan
    found = replay(whole.replace(q=q, valid=valid), PD)
    assert np.isnan(found.u[1500:1510]).all()
    assert not found.used[1500:1520].any()
    assert found.lsb == pytest.approx(1 / np.sqrt(12), rel=0.1)


def test_a_variant_for_which_every_run_is_too_short_is_not_tried():
    """A filter of two corners needs longer runs than a difference of positions."""
    whole = logged()
    valid = np.ones(len(whole), bool)
    valid[::8] = False
    short = whole.replace(valid=valid)
    assert replay(short, PD).used.any()
    with pytest.raises(NotIdentifiableError, match="long enough for the velocity filter"):
        replay(short, PD, "tustin")


def test_a_forward_filter_that_is_unstable_at_this_rate_is_not_offered():
    record = logged()
    slow = record.replace(time=record.time * 10)
    controller = Controller(kp=PD.kp, kd=PD.kd, highpass=200.0, lowpass=300.0)
    assert "forward" in variants(record, controller)
    assert "forward" not in variants(slow, controller)


def test_wrong_gain_leaves_a_residual_far_above_rounding():
    wrong = Controller(kp=[11.0, 8.0], kd=[5.0, 3.0], highpass=200.0, lowpass=300.0,
                       command_resolution=[0.005, 0.01])
    lsb = replay(logged(), wrong).lsb
    assert lsb[0] > 20
    assert lsb[1] == pytest.approx(1 / np.sqrt(12), rel=0.1)


def test_a_servo_is_replayed_with_its_limit_and_only_while_enabled():
    time, q = motion()
    qd = q + 0.3 * np.sin(3 * time)[:, None]
    servo = Controller(law="servo", kp=[5.0, 5.0], saturation=[1.0, 1.0])
    on = (time > 1.0).astype(float)
    u = np.clip(5 * (qd - q), -1, 1) * on[:, None]
    record = Record(time, q, u=u, qd=qd, extra={"torque_enable": on})
    assert np.abs(u).max() == 1.0
    assert replay(record, servo).rms == pytest.approx(0, abs=1e-12)


def test_what_cannot_be_replayed_says_why():
    record = logged()
    with pytest.raises(NotIdentifiableError, match="no reference position qd"):
        replay(record.replace(qd=None), PD)
    with pytest.raises(NotIdentifiableError, match="law is not stated"):
        replay(record, Controller())
    with pytest.raises(ClieError, match="did you mean 'tustin'"):
        replay(record, PD, "tustim")


@pytest.mark.parametrize("number", range(12))
def test_practice_trials_reproduce_the_command_to_half_a_step(shared, number):
    records = read_records(shared / f"blind/practice/trial-{number:03d}")
    for record in records:
        found = replay(record, record.robot.controller)
        step = record.robot.controller.command_resolution
        if number == 11:  # its velocity filter is not the stated one
            assert np.all(found.lsb > 10)
        else:
            assert found.variant == "tustin"
            assert np.all(np.abs(found.residual) <= 0.5001 * step)


def test_the_emps_law_is_reproduced_within_ten_millivolts(shared):
    for record in read_records(shared / "data/emps"):
        found = replay(record, record.robot.controller)
        assert found.variant == "two_tap"
        assert found.rms[0] < 0.010


def test_the_servo_law_is_reproduced_on_all_sixteen_runs(shared):
    rms = [replay(record, record.robot.controller).rms[0]
           for record in read_records(shared / "data/bam_xl330")]
    assert len(rms) == 16
    assert max(rms) < 0.0241
    assert min(rms) < 0.0008
