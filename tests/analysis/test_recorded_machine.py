"""CLIE on recorded robots: known truth from another code path, and the EMPS machine."""

import json

import numpy as np
import pytest
from scipy.linalg import expm

from clie_blocks.analysis.identification import recorded_machine
from clie_blocks.analysis.identification.recorded_clie import (
    RecordedLoop,
    resting_state,
    velocity_block,
)
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.robot import Controller
from clie_blocks.errors import NotIdentifiableError

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
    loop = RecordedLoop(sampled_robot(5.0))
    assert np.max(np.abs(loop.input_error(THETA))) < 1e-9


def test_estimates_converge_to_the_truth_from_zero():
    run = RecordedLoop(sampled_robot()).identify(20)
    np.testing.assert_allclose(run.theta_hat, THETA, rtol=1e-4)
    assert run.changes[-1] < 1e-6


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
        RecordedLoop(bare)


def test_unknown_law_is_refused():
    record = sampled_robot(1.0)
    unknown = Record(time=record.time, q=record.q, u=record.u, qd=record.qd,
                     robot=Robot(n=1, controller=Controller()), source="unknown")
    with pytest.raises(NotIdentifiableError, match="not a PD law"):
        RecordedLoop(unknown)


def test_missing_folder_says_where_the_data_is(capsys):
    from clie_blocks.output import guarded

    assert guarded(recorded_machine.main, ["no/such/folder"]) == 3
    assert "nonlinearbenchmark.org" in capsys.readouterr().err


def test_emps(shared, tmp_path, capsys):
    """Mass within 1 % of the published; the missing Coulomb friction doubles the viscous term."""
    assert recorded_machine.main([str(shared / "data" / "emps"), "--json", "-o",
                                  str(tmp_path)]) == 0
    result = json.loads(capsys.readouterr().out)
    published = recorded_machine.EMPS_PUBLISHED
    assert result["physical"]["mass"][0] == pytest.approx(published["mass"], rel=0.01)
    assert result["physical"]["offset"][0] == pytest.approx(published["offset"], rel=0.03)
    assert 1.8 < result["physical"]["viscous"][0] / published["viscous"] < 2.2
    assert result["condition"]["holds"] is False
    assert result["condition"]["per_joint"][0] == pytest.approx(-0.41, abs=0.01)
    assert result["last_change"] < 1e-9
    assert result["held_out"][0]["input_error_rms"][0] < 1.1 * result["input_error_rms"][0]
    assert (tmp_path / "recorded_loop.png").exists()
