"""The diagnosis on real machines; each figure is also in docs/real_machines.md."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment.torque_map import corrected_error
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.observer import without_observer
from clie_blocks.analysis.gap.problem.position_path import (
    dead_times,
    error_by_hypothesis,
    fit_position_path,
    servo_response,
)
from clie_blocks.analysis.gap.problem.preparation import on_even_clock, prepare
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.torque_path import torque_paths
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.report.checks import checks_section, saturated_share
from clie_blocks.analysis.gap.report.wording import units_of
from clie_blocks.analysis.records import Record, Robot, read_records
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.repeatability import noise_floor
from clie_blocks.errors import NotIdentifiableError, RecordError

pytestmark = pytest.mark.slow
DRY = {"coulomb", "asymmetric_coulomb", "stribeck", "presliding", "load_dependent_friction"}
LOOSE = ("backlash", "joint_elasticity")


def named(records, *names):
    """Records in the order of names, each the first whose source contains the name."""
    return [next(record for record in records if name in record.source) for name in names]


def printed_answer(name, diagnosis):
    """Print the figures of the page, and return the answer."""
    stored = answer(diagnosis)
    print(f"\n{name}: {diagnosis.verdict}, {diagnosis.seconds:.1f} s; gap "
          f"{stored['gap_before']:.3g} -> {stored['gap_after']:.3g}, noise "
          f"{stored['gap_floor']:.3g}, closed {stored['closed_percent']}; set {stored['set_90']}")
    for row in diagnosis.ranking[:6]:
        print(f"  {' + '.join(row.names):40} p {row.probability:.3f}  excess {row.excess:.4g}")
    values = diagnosis.model.hypothesis.values
    print("  ", {key: value.round(5).tolist() for key, value in values.items()
                 if "." in key and not key.startswith("links.")})
    return stored


def test_emps_is_dry_friction_without_delay(shared):
    records = read_records(shared / "data" / "emps")
    robot, records = prepare(records[0].robot, records)
    diagnosis = diagnose(Problem.from_logs(robot, records))
    stored = printed_answer("EMPS", diagnosis)
    assert cause_names(diagnosis)[0] == "coulomb" and "coulomb" in stored["set_90"]
    assert "time_delay" not in stored["set_90"] and "actuator_lag" not in stored["set_90"]
    assert cause_names(diagnosis)[1] in ("stribeck", "asymmetric_coulomb")
    assert stored["closed_percent"]["unseen_data"]
    assert stored["gap_after"] < 2.2e-6 < 6e-6 < stored["gap_before"]  # m, on PULSES
    repeated = noise_floor(records[0])  # the machine repeats its laps ten times better
    assert repeated.method == "periods" and 1e-7 < repeated.std[0] < 3e-7
    assert stored["gap_after"] > 5 * repeated.std[0]
    log, error = diagnosis.problem.logs[1], diagnosis.model.hypothesis.error(1, dithered=False)
    measured, simulated = (np.std(x) for x in (log.q_d - log.q, log.q_d - log.q + error))
    assert simulated == pytest.approx(measured, rel=2e-3)  # 0.58 mm behind the reference
    torque_map = diagnosis.torque_map
    print("  torque map:", torque_map.percent, torque_map.interval, torque_map.gap)
    assert torque_map.causes == ("coulomb",) and torque_map.gap < 1.6e-6
    assert torque_map.interval[0] > 10.0
    error = corrected_error(diagnosis.model.hypothesis, torque_map.joints, 1)
    assert np.std(log.q_d - log.q + error) == pytest.approx(measured, rel=2e-3)
    values, force = diagnosis.model.hypothesis.values, records[0].robot.motor.torque_gain[0]
    assert values["coulomb.level"][0] * force == pytest.approx(20.39, rel=0.05)  # published
    assert values["inertia"][0] * force == pytest.approx(95.11, rel=0.03)


# BAM's own models of it: m3 and m4 lose a share of the load, m5 and m6 more in one direction.
GROWS_WITH_LOAD = {"load_dependent_friction", "directional_efficiency"}
ALIKE_AT_ANY_LOAD = {"coulomb", "asymmetric_coulomb", "dahl", "maxwell_slip", "presliding",
                     "stribeck"}


def test_bam_servo_saturates_and_its_friction_grows_with_load(shared):
    records = read_records(shared / "data" / "bam_xl330")
    records = named(records, "(sin_sin, P 800)", "(sin_time_square, P 800)")
    diagnosis = diagnose(Problem.from_logs(records[0].robot, records))
    stored = printed_answer("BAM, P 800, whole library", diagnosis)
    print("  samples at the limit", saturated_share(diagnosis))
    assert saturated_share(diagnosis)[0] > 0.1
    flagged = " ".join(checks_section(diagnosis, units_of(records)).points)
    assert "is at its limit for up to 16 % of the time" in flagged
    assert GROWS_WITH_LOAD & set(stored["set_90"])
    without = sum(row.probability for row in diagnosis.ranking
                  if not GROWS_WITH_LOAD & set(row.names))
    assert without < 0.1  # friction that does not grow may stand beside it, as in m5 and m6
    leading = diagnosis.ranking[0]
    assert set(leading.names) - {"actuator_saturation", "payload"} <= GROWS_WITH_LOAD
    assert leading.probability > 0.5 and stored["verdict"] == "effect"
    assert GROWS_WITH_LOAD & set(members(diagnosis))
    assert stored["closed_percent"]["unseen_data"]
    alone = {row.names[0]: row.excess for row in diagnosis.ranking if len(row.names) == 1}
    assert (min(alone[name] for name in GROWS_WITH_LOAD & set(alone))
            < 0.2 * min(alone[name] for name in ALIKE_AT_ANY_LOAD & set(alone)))
    assert stored["gap_after"] < 0.3 * stored["gap_before"]


def test_logs_with_several_gains_are_diagnosed_one_gain_at_a_time(shared):
    records = read_records(shared / "data" / "bam_xl330")
    with pytest.raises(RecordError, match="one set of gains"):
        prepare(records[0].robot, records)


def test_so101_has_delay_and_dry_friction_and_each_hides_the_other(shared):
    records = read_records(shared / "data" / "sage_so101")
    motions = named(records, "prbs_excitation", "static_holding")
    medians = [np.median(dead_times(motion, k)) for motion in motions for k in range(5)
               if dead_times(motion, k).size]
    assert np.median(medians) == pytest.approx(0.04, abs=1e-3)  # second sample of a new set-point
    fitted, unseen = (on_even_clock(record, record.robot.controller)
                      for record in named(records, "prbs_excitation", "step_response"))
    by_joint = {fitted.joints[k]: error_by_hypothesis(fitted, unseen, k) for k in range(5)}
    for joint, by_name in by_joint.items():
        errors = {name: round(1e3 * error, 2) for name, (_, error) in by_name.items()}
        print(f"  {joint:12}", errors, by_name["both"][0])
    rotation = {name: error for name, (_, error) in by_joint["rotation"].items()}
    assert rotation["both"] < 0.5 * min(rotation[name] for name in
                                        ("lag", "setpoint_delay", "coulomb"))
    for by_name in by_joint.values():
        paths = {name: path for name, (path, _) in by_name.items()}
        assert 0.015 < paths["both"].delay < 0.03
        assert paths["both"].rms_error < min(paths["setpoint_delay"].rms_error,
                                             paths["coulomb"].rms_error)
    path = by_joint["rotation"]["both"][0]
    reaction = reaction_time(path)
    print("  rotation: delay", path.delay, "lag and friction", reaction)
    assert 0.02 < path.delay + reaction < 0.04  # read at the sample of 40 ms


def reaction_time(path, step=0.2, period=0.02):
    """Time that a fitted servo without delay takes to 5 % of a step [s]."""
    set_point, leads = np.repeat([0.0, step], [1, 20]), np.linspace(0.0, 0.02, 81)
    positions = np.array([servo_response(set_point, 0.0, period, path.frequency,
                                         path.damping_ratio, 0.0, lead, path.level)[2]
                          for lead in leads])
    return period - leads[np.flatnonzero(positions > 0.05 * step)[-1]]


def test_so101_has_a_delay_first_then_a_coarse_encoder_and_dry_friction(shared):
    records = read_records(shared / "data" / "sage_so101")
    robot, ready = prepare(*one_joint(named(
        records, "prbs_excitation", "multisine", "step_response"), 0))
    diagnosis = diagnose(Problem.from_logs(robot, ready))
    stored = printed_answer("SO-101, rotation", diagnosis)
    (decision,) = {record.decisions[-1] for record in ready}
    print(" ", decision)
    assert "the dead time is 60 ms" in decision
    assert "the delay of the set-points is 2" in decision
    names = [row["effect"] for row in stored["effects"]]
    delay, step = stored["effects"][0], stored["effects"][names.index("encoder_quantization")]
    print("  delay", delay, "\n  left", diagnosis.findings[0].left)
    assert diagnosis.verdict == "effect" and names[0] == "time_delay" == stored["set_90"][0]
    assert delay["probability"] > 0.9 and delay["joint"] == [1]
    assert delay["parameters"]["dead_time"]["value"][0] == pytest.approx(0.06, abs=1e-3)
    (low,), (high,) = delay["parameters"]["delay"]["interval"]
    assert 0.015 < low < delay["parameters"]["delay"]["value"][0] < high < 0.03
    error = {name: rms[0] for name, rms in diagnosis.findings[0].left.items()}
    assert error["both"] < 0.5 * min(error[name] for name in ("lag", "setpoint_delay", "coulomb"))
    assert step["parameters"]["step"]["value"][0] == pytest.approx(1.534e-3, rel=0.01)
    assert cause_names(diagnosis)[0] == "coulomb"  # after the delay
    assert cause_names(diagnosis)[1] in ("stribeck", "asymmetric_coulomb")
    assert stored["families"]["friction"] > 0.8
    level = diagnosis.model.hypothesis.values["coulomb.level"][0]
    path = fit_position_path(ready[0], 0, ("delay", "level"))
    # two routes to a level that few stops determine
    assert level == pytest.approx(path.level, rel=0.15)
    assert stored["gap_after"] < 0.42 * stored["gap_before"]


def cause_names(diagnosis):
    """Leading causes of the ranking, without `none` and `unknown`."""
    return [row.names[0] for row in diagnosis.ranking if row.names[0] not in ("none", "unknown")]


def members(diagnosis):
    """Names of the causes that the corrected model holds."""
    return {member.cause.name for member in diagnosis.model.hypothesis.members}


def one_joint(records, k):
    """Robot and records of one joint, without what is known of its encoder."""
    robot = Robot(n=1, joints=(records[0].joints[k],),
                  controller=Controller(law="unknown", sample_time=0.02))
    return robot, [Record(time=record.time, q=record.q[:, [k]], qd=record.qd[:, [k]],
                          joints=robot.joints, source=record.source, robot=robot)
                   for record in records]


def test_dfki_drives_have_a_delay_and_the_joints_dry_friction(shared):
    records = read_records(shared / "data" / "dfki_double_pendulum")
    records = [record for record in records if "C.1" in record.robot.name]
    sines = [record for record in records if np.abs(record.u).max() < 1.0]
    paths = [path for record in sines for path in torque_paths(record)]
    print("\nDFKI torque path: delay", [round(path.total_delay, 4) for path in paths], "gain",
          [round(path.gain, 2) for path in paths])
    assert all(0.01 < path.total_delay < 0.04 for path in paths if path.lag > 1e-4)
    assert np.ptp([path.gain for path in paths]) > 0.2
    robot, ready = prepare(records[0].robot, [sines[i] for i in (0, 2, 5, 1)])
    assert all("the measured torque is" in record.decisions[-1] for record in ready)
    diagnosis = diagnose(Problem.from_logs(robot, ready), exclude=LOOSE)
    stored = printed_answer("DFKI, design C.1", diagnosis)
    print("  ", stored["effects"][:3])
    assert cause_names(diagnosis)[0] == "coulomb" and members(diagnosis) == {"coulomb"}
    assert stored["closed_percent"]["judged_by"] == "recorded command with an observer"
    assert stored["gap_after"] < 0.6 * stored["gap_before"] and stored["gap_after"] < 2.5e-3
    alone = [without_observer(fit.hypothesis, diagnosis.problem).error(3, dithered=False)
             for fit in (diagnosis.nominal, diagnosis.model)]
    before, after = (np.sqrt(np.mean(np.sum(error**2, axis=1))) for error in alone)
    assert after < 0.083 and after < 0.35 * before  # rad, from the commands alone
    rows = {row["effect"]: row for row in stored["effects"]}
    lag = rows["actuator_lag"]
    assert stored["effects"][0] == lag and lag["joint"] == [2]  # most of joint 1 is something else
    assert 0.5 < lag["probability"] < 0.8
    assert rows.get("torque_gain_error", {"probability": 0.0})["probability"] < 0.05
    low, high = lag["parameters"]["lag"]["interval"]
    assert 0.025 < low[0] < high[0] < 0.045


def test_a_log_without_command_and_reference_is_refused(shared):
    record = read_records(shared / "data" / "sage_so101")[0]
    with pytest.raises(NotIdentifiableError, match="neither a command u nor a reference"):
        prepare(record.robot, [record.replace(qd=None)])
