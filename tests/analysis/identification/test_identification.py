"""Identification: known truth, the sensitivity by a second route, coverage, real logs."""

import dataclasses
import json

import control as ct
import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.identification import identify
from clie_blocks.analysis.identification.agreement import agreement, disagreements
from clie_blocks.analysis.identification.closed_loop import (
    closed_loop_least_squares,
    model_motion,
    sensitivity,
)
from clie_blocks.analysis.identification.command import main
from clie_blocks.analysis.identification.motion import rough_inertia, split
from clie_blocks.analysis.identification.prediction import predict
from clie_blocks.analysis.identification.regression import Estimate, idim_least_squares
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.model import Record, Robot
from clie_blocks.analysis.records.read import read_records
from clie_blocks.analysis.records.replay import velocity
from clie_blocks.errors import ClieError, NotIdentifiableError, RecordError

INERTIA = np.array([0.5, 0.8, 0.3])
FRICTION = np.array([1.0, 2.0, 0.7])
PAPER = ("inertia", "viscous", "offset")
STEP = 1e-3


@pytest.fixture(scope="module")
def result(clean):
    return identify([clean])


def methods(joint):
    return {estimate.method: estimate for estimate in joint}


def test_every_method_finds_the_known_truth(result):
    assert list(methods(result.estimates[0])) == [
        "CLIE (27)", "composite (40)", "closed-loop LS", "instrumental variables", "IDIM-LS"]
    for k, joint in enumerate(result.estimates):
        for estimate in joint:
            assert estimate.get("inertia")[0] == pytest.approx(INERTIA[k], rel=0.01)
            assert estimate.get("viscous")[0] == pytest.approx(FRICTION[k], rel=0.03)
            assert abs(estimate.get("offset")[0]) < 0.005


def test_the_methods_agree_and_nothing_is_missing_in_a_healthy_loop(result):
    assert result.disagreements == []
    assert np.all(np.abs(result.error_over_noise - 1) < 0.1)


def test_the_closed_loop_interval_is_the_tightest_and_covers_the_truth(result):
    for k, joint in enumerate(result.estimates):
        by_name = methods(joint)
        value, width = by_name["closed-loop LS"].get("inertia")
        assert width < by_name["IDIM-LS"].get("inertia")[1]
        assert abs(value - INERTIA[k]) < 3 * width + 2e-4 * INERTIA[k]


def test_the_sensitivity_agrees_with_python_control(robot):
    loop = sensitivity(0.5, 1.0, robot.controller, 0, STEP)
    plant = ct.sample_system(ct.tf([1], [0.5, 1.0, 0]), STEP, "zoh")
    g1 = ct.sample_system(ct.tf([200 * 300, 0], [1, 500, 60000]), STEP, "tustin")
    other = ct.feedback(plant, 20.0 + 4.0 * g1)
    omega = np.geomspace(0.1, 1000, 40)
    z = np.exp(1j * omega * STEP)
    ours = (np.polyval(loop.torque[::-1], 1 / z)
            / np.polyval(loop.denominator[::-1], 1 / z))
    assert np.allclose(ours, other(z), rtol=1e-6)


def test_the_simulation_agrees_with_the_linear_loop(clean):
    record = clean.replace(u=None)
    estimate = Estimate("given", PAPER, np.array([0.55, 1.2, 0.1]), np.zeros(3))
    q, u = predict(record, np.zeros(len(record)), 0, estimate)
    own = clean.replace(q=np.stack([q] * 3, 1), u=np.stack([u] * 3, 1))
    runs = split([own], rough_inertia(own))
    linear = model_motion(runs[0], np.zeros(own.q.shape), 0, PAPER, estimate.value, 1.0)[0]
    assert np.allclose(linear, q, atol=1e-9)


def test_dry_friction_in_the_simulation_truly_sticks(clean):
    still = clean.replace(qd=np.tile(clean.q[0] + 0.01, (len(clean), 1)), pe=None)
    sticky = Estimate("given", (*PAPER, "coulomb"), np.array([0.5, 1.0, 0.0, 0.5]), np.zeros(4))
    q, _ = predict(still, np.zeros(len(still)), 0, sticky)
    assert np.ptp(q) == 0.0  # Kp times the error is 0.2, less than the friction of 0.5
    weak = dataclasses.replace(sticky, value=np.array([0.5, 1.0, 0.0, 0.0]))
    free, _ = predict(still, np.zeros(len(still)), 0, weak)
    assert free[-1] == pytest.approx(still.qd[0, 0], abs=1e-6)


def test_the_interval_covers_the_truth_under_coloured_torque_noise(clean):
    """Each joint is a replicate; with its own slow random torque."""
    record = replicates(clean, 24)
    runs = split([record], rough_inertia(record))
    loads = [np.zeros(run.q.shape) for run in runs]
    hits = []
    for k in range(record.n):
        start = idim_least_squares(runs, loads, k, PAPER)
        value, width = closed_loop_least_squares(runs, loads, k, start).get("inertia")
        hits.append(abs(value - 0.5) < width)
    assert np.mean(hits) >= 0.8


def replicates(clean, count):
    """Logs of the first joint's loop, each under a slow random torque of its own."""
    loop = sensitivity(0.5, 1.0, clean.robot.controller, 0, STEP)
    qd, pe = (np.repeat(x[:, :1], count, axis=1) for x in (clean.qd, clean.pe))
    white = np.random.default_rng(11).standard_normal(qd.shape)
    torque = 0.5 * lfilter([0.02], [1, -0.98], white, axis=0)
    q = qd[0] + loop.respond(20.0 * (qd - qd[0]) + pe + torque)
    controller = dataclasses.replace(clean.robot.controller, kp=np.full(count, 20.0),
                                     kd=np.full(count, 4.0), command_resolution=None)
    record = Record(clean.time, q, qd=qd, pe=pe, robot=Robot(count, controller=controller))
    dq = velocity(record, controller, "tustin")
    return record.replace(u=control_law(controller, STEP).command(qd - q, dq, pe))


def test_disagreements_need_both_an_interval_and_a_difference():
    def of(method, viscous, width):
        return Estimate(method, PAPER, np.array([1.0, viscous, 0.0]),
                        np.array([0.01, width, 0.01]))

    reference = of("closed-loop LS", 2.0, 0.02)
    assert disagreements("arm", [reference, of("IDIM-LS", 2.03, 0.03)]) == []
    assert disagreements("arm", [reference, of("composite (40)", 9.0, np.nan)]) == []
    found = disagreements("arm", [reference, of("IDIM-LS", 2.2, 0.03)])
    assert [d.term for d in found] == ["viscous"]
    assert "arm: IDIM-LS gives viscous = 2.2, closed-loop LS gives 2;" in str(found[0])


def test_methods_agree_only_where_their_intervals_do():
    def of(method, viscous, width):
        return Estimate(method, PAPER, np.array([1.0, viscous, 0.0]),
                        np.array([0.01, width, 0.01]))

    reference = of("closed-loop LS", 2.0, 0.005)
    assert agreement([[reference, of("IDIM-LS", 2.01, 0.01)]]) == (
        "The methods agree within their intervals.")
    assert "within 1%, though not within" in agreement([[reference, of("IDIM-LS", 2.015, 0.005)]])
    unknown = Estimate("composite (40)", PAPER, np.ones(3), np.full(3, np.nan))
    for alone in ([reference], [reference, unknown], [unknown]):
        assert "cannot be told" in agreement([alone])


def test_a_log_with_an_error_is_refused_and_one_of_several_is_left_out(clean):
    turned = clean.replace(u=-clean.u, source="turned.csv")
    with pytest.raises(RecordError, match="turned.csv: .*a sign is wrong"):
        identify([turned])
    with pytest.raises(NotIdentifiableError, match="no 'u'.*--map u=COLUMN"):
        identify([clean.replace(u=None)])
    with pytest.raises(ClieError, match="did you mean 'coulomb'"):
        identify([clean], extra=["columb"])
    result = identify([turned, clean])
    assert result.sources == [clean.source]
    assert any("Left out turned.csv" in text for text in result.warnings)


def test_an_unknown_law_leaves_the_textbook_method(clean):
    robot = dataclasses.replace(clean.robot, controller=type(clean.robot.controller)())
    result = identify([clean.replace(robot=robot)])
    assert [e.method for e in result.estimates[0]] == ["IDIM-LS"]
    assert any("law is not stated" in text for text in result.warnings)


@pytest.fixture(scope="module")
def emps(shared):
    fitted, pulses = read_records(shared / "data/emps")
    return {"with": identify([fitted], [pulses], ["coulomb"]), "without": identify([fitted])}


@pytest.mark.parametrize("method", ["CLIE (27)", "composite (40)", "closed-loop LS",
                                    "instrumental variables", "IDIM-LS"])
def test_emps_with_coulomb_gives_the_published_parameters(emps, method):
    estimate, gain = methods(emps["with"].estimates[0])[method], emps["with"].scale[0]
    assert estimate.get("inertia")[0] * gain == pytest.approx(95.1089, rel=0.01)
    assert estimate.get("viscous")[0] * gain == pytest.approx(203.5034, rel=0.05)


def test_the_violated_condition_of_the_theorems_is_reported(emps, result):
    assert "K-bar -0.43 < 0" in methods(emps["with"].estimates[0])["CLIE (27)"].note
    assert all("K-bar" not in joint[0].note for joint in result.estimates)


def test_emps_without_coulomb_doubles_the_viscous_friction(emps):
    for estimate in emps["without"].estimates[0]:
        viscous = estimate.get("viscous")[0] * emps["without"].scale[0]
        assert viscous == pytest.approx(411, rel=0.01)
    bias = next(b for b in emps["with"].biases if b.term == "viscous")
    assert bias.without / bias.value == pytest.approx(2.03, abs=0.03)
    assert emps["without"].error_over_noise[0] > 25
    assert emps["with"].error_over_noise[0] < 8


def test_emps_predicts_the_log_with_pulses(emps):
    for prediction in emps["with"].predictions:
        assert prediction.position_rms[0] < 2.2e-6
        assert prediction.input_rms[0] < 0.06 * prediction.command_rms[0]


@pytest.mark.parametrize("number", [5, 10])
def test_a_healthy_trial_is_predicted_down_to_its_noise(shared, number):
    records = read_records(shared / f"blind/practice/trial-{number:03d}")
    result = identify(records[:-1], records[-1:])
    assert result.disagreements == []
    assert np.all(result.error_over_noise < 1.3)
    for prediction in result.predictions:
        assert np.all(prediction.position_rms < 1.3 * prediction.noise)


def test_the_command_prints_a_table_and_json(shared, capsys, tmp_path):
    log = str(shared / "data/emps")
    assert main([log, "--with", "coulomb"]) == 0
    text = capsys.readouterr().out
    assert "inertia [kg]" in text
    assert "Without the extra terms: axis inertia" in text
    assert "DATA_EMPS_PULSES.parquet, not used for the fit" in text
    assert main([log, "--json", "-o", str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert answer["schema_version"] == 1
    assert answer == json.loads((tmp_path / "identification.json").read_text())
    assert (tmp_path / "clie.svg").exists()
