"""CLIE on recorded robots: known truth from another code path, and the EMPS machine."""

import numpy as np
import pytest
from scipy.linalg import expm

from clie_blocks.analysis.identification.clie import RATE, clie
from clie_blocks.analysis.identification.log_loop import LogLoop, resting_state, velocity_block
from clie_blocks.analysis.identification.motion import rough_inertia, split
from clie_blocks.analysis.records import Record, Robot, read_records
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.errors import DivergedError, NotIdentifiableError
from clie_blocks.signals import signal

PERIOD, KP, KD = 1e-3, 40.0, 8.0
THETA = np.array([2.0, 0.5, 0.1])


def controller(**changes):
    return Controller(**{"law": "pd", "kp": KP, "kd": KD, "velocity_filter": "two_tap",
                         "sample_time": PERIOD, **changes})


def sampled_robot(seconds=30.0, **changes):
    """Log of one joint under a sampled PD; scipy's matrix exponential moves the joint."""
    a, b, d = THETA
    step = expm(np.array([[0, 1, 0], [0, -a, 1], [0, 0, 0]]) * PERIOD)
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    q_d = 0.4 * np.sin(2.1 * time) + 0.2 * np.sin(7.3 * time)
    x, older, q, u = np.zeros(2), [0.0, 0.0], [], []
    for wanted in q_d:
        dq = (x[0] - older[0]) / (2 * PERIOD)
        older = [older[1], x[0]]
        q.append(x[0])
        u.append(KP * (wanted - x[0]) - KD * dq)
        x = (step @ np.append(x, b * u[-1] - d))[:2]
    return Record(time=time, q=q, u=u, qd=q_d, source="synthetic",
                  robot=Robot(n=1, controller=controller(**changes)))


def test_true_parameters_leave_no_input_error():
    run = LogLoop.of(sampled_robot(5.0), RATE).run(THETA, frozen=True)
    assert np.max(np.abs(signal(run, "e_u"))) < 1e-9


def identified(record):
    """Estimates of the one joint, and the last pass."""
    runs = split([record], rough_inertia(record))
    (estimate,), last = clie(runs, [np.zeros(run.q.shape) for run in runs])
    return estimate, last


def test_estimates_converge_to_the_truth_from_zero():
    estimate, last = identified(sampled_robot())
    np.testing.assert_allclose(last.theta, THETA, rtol=1e-4)
    a, b, d = THETA
    np.testing.assert_allclose(estimate.value, [1 / b, a / b, d / b], rtol=1e-4)
    assert last.settled and f"{last.passes} passes" in estimate.note


def test_the_rate_is_without_influence_where_the_model_is_complete(monkeypatch):
    monkeypatch.setattr("clie_blocks.analysis.identification.clie.RATE", 4 * RATE)
    np.testing.assert_allclose(identified(sampled_robot())[1].theta, THETA, rtol=1e-4)


def test_estimates_that_do_not_settle_are_an_error(monkeypatch):
    monkeypatch.setattr("clie_blocks.analysis.identification.clie.MOST_PASSES", 1)
    with pytest.raises(DivergedError, match="do not settle in 1 passes"):
        identified(sampled_robot(5.0))


@pytest.mark.parametrize("options", [
    {"velocity_filter": "two_tap"}, {"velocity_filter": "difference"},
    {"velocity_filter": "two_corner", "highpass": 200.0, "lowpass": 300.0}])
def test_velocity_estimate_at_rest_gives_zero(options):
    block = velocity_block(controller(**options), 2, PERIOD)
    q = np.array([0.3, -0.7])
    x = resting_state(block, q)
    np.testing.assert_allclose(block.A @ x + block.B @ q, x, atol=1e-12)
    np.testing.assert_allclose(block.C @ x + block.D @ q, 0, atol=1e-9)


def test_log_without_reference_is_refused():
    record = sampled_robot(1.0)
    bare = Record(time=record.time, q=record.q, u=record.u, robot=record.robot, source="bare")
    with pytest.raises(NotIdentifiableError, match="no 'qd'.*--map qd=COLUMN"):
        LogLoop.of(bare, RATE)


def test_unknown_law_is_refused():
    record = sampled_robot(1.0)
    unknown = Record(time=record.time, q=record.q, u=record.u, qd=record.qd,
                     robot=Robot(n=1, controller=Controller()), source="unknown")
    with pytest.raises(NotIdentifiableError, match="not a PD law"):
        LogLoop.of(unknown, RATE)


def test_emps(shared):
    """Mass near the published one; the missing Coulomb friction doubles the viscous term."""
    fitted, pulses = read_records(shared / "data" / "emps")
    gain = fitted.robot.motor.torque_gain[0]
    estimate, last = identified(fitted)
    mass, viscous, offset = gain * estimate.value
    assert mass == pytest.approx(94.965, abs=0.002)  # the figure of the README
    assert abs(mass - 95.1089) < gain * estimate.get("inertia")[1]  # published
    assert offset == pytest.approx(-3.1648, rel=0.03)
    assert 1.8 < viscous / 203.5034 < 2.2
    assert "K-bar -0.41 < 0" in estimate.note
    errors = [np.std(signal(LogLoop.of(log, RATE).run(last.theta, frozen=True), "e_u"))
              for log in (fitted, pulses)]
    assert errors[1] < 1.1 * errors[0]
