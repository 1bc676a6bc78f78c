"""The diagnosis on real machines; each figure is also in docs/real_machines.md."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment.torque_map import corrected_error
from clie_blocks.analysis.gap.diagnosis import diagnose
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
from clie_blocks.analysis.records.repeatability import noise_floor
from clie_blocks.analysis.records.robot import Controller
from clie_blocks.errors import NotIdentifiableError, RecordError

pytestmark = pytest.mark.slow
DRY = {"coulomb", "asymmetric_coulomb", "stribeck", "presliding", "load_dependent_friction"}
LOOSE = ("backlash", "joint_elasticity")


def named(records, *words):
    """Records in the order of words, each the one record whose source holds it."""
    return [next(record for record in records if word in record.source) for word in words]


def told(name, found):
    """Print the figures of the page, and return the answer."""
    said = answer(found)
    print(f"\n{name}: {found.verdict}, {found.seconds:.1f} s; gap {said['gap_before']:.3g} -> "
          f"{said['gap_after']:.3g}, noise {said['gap_floor']:.3g}, closed "
          f"{said['closed_percent']}; set {said['set_90']}")
    for row in found.ranking[:6]:
        print(f"  {' + '.join(row.names):40} p {row.probability:.3f}  excess {row.excess:.4g}")
    values = found.model.hypothesis.values
    print("  ", {key: value.round(5).tolist() for key, value in values.items()
                 if "." in key and not key.startswith("chain")})
    return said


def test_emps_is_dry_friction_without_delay(shared):
    records = read_records(shared / "data" / "emps")
    robot, records = prepare(records[0].robot, records)
    found = diagnose(Problem.from_logs(robot, records))
    said = told("EMPS", found)
    assert cause_names(found)[0] == "coulomb" and "coulomb" in said["set_90"]
    assert "time_delay" not in said["set_90"] and "actuator_lag" not in said["set_90"]
    assert cause_names(found)[1] == "asymmetric_coulomb"
    assert said["closed_percent"]["unseen_data"]
    assert said["gap_after"] < 2.2e-6 < 6e-6 < said["gap_before"]  # m, on PULSES
    repeated = noise_floor(records[0])  # the machine repeats its laps ten times better
    assert repeated.method == "periods" and 1e-7 < repeated.std[0] < 3e-7
    assert said["gap_after"] > 5 * repeated.std[0]
    log, error = found.problem.logs[1], found.model.hypothesis.error(1, dithered=False)
    measured, simulated = (np.std(x) for x in (log.q_d - log.q, log.q_d - log.q + error))
    assert simulated == pytest.approx(measured, rel=2e-3)  # 0.58 mm behind the reference
    table = found.torque_map
    print("  table of torque:", table.percent, table.interval, table.gap)
    assert table.causes == ("coulomb",) and table.gap < 1.6e-6 and table.interval[0] > 10.0
    with_table = np.std(log.q_d - log.q + corrected_error(found.model.hypothesis, table.joints, 1))
    assert with_table == pytest.approx(measured, rel=2e-3)
    values, force = found.model.hypothesis.values, records[0].robot.motor.torque_gain[0]
    assert values["coulomb.level"][0] * force == pytest.approx(20.39, rel=0.05)  # published
    assert values["inertia"][0] * force == pytest.approx(95.11, rel=0.03)


def test_bam_servo_saturates_and_its_friction_grows_with_load(shared):
    records = read_records(shared / "data" / "bam_xl330")
    records = named(records, "(sin_sin, P 800)", "(sin_time_square, P 800)")
    found = diagnose(Problem.from_logs(records[0].robot, records))
    said = told("BAM, P 800, whole library", found)
    print("  samples at the limit", saturated_share(found))
    assert saturated_share(found)[0] > 0.1
    flagged = " ".join(checks_section(found, units_of(records)).points)
    assert "is at its limit for up to 16 % of the time" in flagged
    assert "load_dependent_friction" in said["set_90"] and "coulomb" not in said["set_90"]
    leading = found.ranking[0]
    assert set(leading.names) - {"actuator_saturation", "payload"} == {"load_dependent_friction"}
    assert leading.probability > 0.5 and said["verdict"] == "effect"
    assert "load_dependent_friction" in members(found) and said["closed_percent"]["unseen_data"]
    plain = min(row.excess for row in found.ranking if "coulomb" in row.names)
    grows = min(row.excess for row in found.ranking if "load_dependent_friction" in row.names)
    assert grows < 0.75 * plain
    alone = {row.names: row.excess for row in found.ranking}
    assert alone["load_dependent_friction",] < 0.2 * alone["coulomb",]
    assert said["gap_after"] < 0.3 * said["gap_before"]


def test_logs_with_several_gains_are_diagnosed_one_gain_at_a_time(shared):
    records = read_records(shared / "data" / "bam_xl330")
    with pytest.raises(RecordError, match="one set of gains"):
        prepare(records[0].robot, records)


def test_so101_is_late_and_sticks_and_each_hides_the_other(shared):
    records = read_records(shared / "data" / "sage_so101")
    motions = named(records, "prbs_excitation", "static_holding")
    late = [np.median(dead_times(motion, k)) for motion in motions for k in range(5)
            if dead_times(motion, k).size]
    assert np.median(late) == pytest.approx(0.04, abs=1e-3)  # second tick with the new goal
    fitted, judged = map(on_even_clock, named(records, "prbs_excitation", "step_response"))
    found = {fitted.joints[k]: error_by_hypothesis(fitted, judged, k) for k in range(5)}
    for joint, by in found.items():
        print(f"  {joint:12}", {name: round(1e3 * left, 2) for name, (_, left) in by.items()},
              by["both"][0])
    rotation = {name: left for name, (_, left) in found["rotation"].items()}
    assert rotation["both"] < 0.5 * min(rotation[name] for name in
                                        ("lag", "setpoint_delay", "coulomb"))
    assert all(0.015 < by["both"][0].delay < 0.03 for by in found.values())
    assert all(by["both"][0].rms_error < min(by[name][0].rms_error for name in ("setpoint_delay", "coulomb"))
               for by in found.values())
    path = found["rotation"]["both"][0]
    start = reaction(path)
    print("  rotation: delay", path.delay, "lag and friction", start)
    assert 0.02 < path.delay + start < 0.04  # read at the tick of 40 ms


def reaction(path, goal=0.2, period=0.02):
    """Time that a fitted servo takes to 5 % of a step when nothing is late [s]."""
    late = [servo_response(np.repeat([0.0, goal], [1, 20]), 0.0, period, path.frequency,
                     path.damping_ratio, 0.0, early, path.level)[2]
            for early in np.linspace(0.0, 0.02, 81)]
    return period - np.linspace(0.0, 0.02, 81)[np.flatnonzero(np.array(late) > 0.05 * goal)[-1]]


def test_so101_is_late_first_of_all_then_coarse_and_sticks(shared):
    records = read_records(shared / "data" / "sage_so101")
    robot, ready = prepare(*one_joint(named(
        records, "prbs_excitation", "multisine", "step_response"), 0))
    found = diagnose(Problem.from_logs(robot, ready))
    said = told("SO-101, rotation", found)
    (read,) = {record.decisions[-1] for record in ready}
    print(" ", read)
    assert "the dead time is 60 ms" in read and "the delay of the set-points is 2" in read
    names = [row["effect"] for row in said["effects"]]
    delay, step = said["effects"][0], said["effects"][names.index("encoder_quantization")]
    print("  delay", delay, "\n  left", found.findings[0].left)
    assert found.verdict == "effect" and names[0] == "time_delay" == said["set_90"][0]
    assert delay["probability"] > 0.9 and delay["joint"] == [1]
    assert delay["parameters"]["dead_time"]["value"][0] == pytest.approx(0.06, abs=1e-3)
    (low,), (high,) = delay["parameters"]["time"]["interval"]
    assert 0.015 < low < delay["parameters"]["time"]["value"][0] < high < 0.03
    left = {name: rms[0] for name, rms in found.findings[0].left.items()}
    assert left["both"] < 0.5 * min(left[name] for name in ("lag", "setpoint_delay", "coulomb"))
    assert step["parameters"]["step"]["value"][0] == pytest.approx(1.534e-3, rel=0.01)
    assert cause_names(found)[:2] == ["coulomb", "asymmetric_coulomb"]  # what is left beside it
    assert said["families"]["friction"] > 0.8
    level = found.model.hypothesis.values["coulomb.level"][0]
    assert level == pytest.approx(fit_position_path(ready[0], 0, ("delay", "level")).level, rel=0.1)
    assert said["gap_after"] < 0.4 * said["gap_before"]


def cause_names(found):
    """Leading causes of the ranking, without `none` and `unknown`."""
    return [row.names[0] for row in found.ranking if row.names[0] not in ("none", "unknown")]


def members(found):
    """Names of the causes that the corrected model holds."""
    return {member.cause.name for member in found.model.hypothesis.members}


def one_joint(records, k):
    """Robot and records of one joint, without what is known of its encoder."""
    robot = Robot(n=1, joints=(records[0].joints[k],),
                  controller=Controller(law="unknown", sample_time=0.02))
    return robot, [Record(time=record.time, q=record.q[:, [k]], qd=record.qd[:, [k]],
                          joints=robot.joints, source=record.source, robot=robot)
                   for record in records]


def test_dfki_drives_are_late_and_the_joints_have_dry_friction(shared):
    records = read_records(shared / "data" / "dfki_double_pendulum")
    records = [record for record in records if "C.1" in record.robot.name]
    sines = [record for record in records if np.abs(record.u).max() < 1.0]
    paths = [path for record in sines for path in torque_paths(record)]
    print("\nDFKI torque path: late", [round(path.total_delay, 4) for path in paths], "gain",
          [round(path.gain, 2) for path in paths])
    assert all(0.01 < path.total_delay < 0.04 for path in paths if path.lag > 1e-4)
    assert np.ptp([path.gain for path in paths]) > 0.2
    robot, ready = prepare(records[0].robot, [sines[i] for i in (0, 2, 5, 1)])
    assert all("the measured torque is" in record.decisions[-1] for record in ready)
    found = diagnose(Problem.from_logs(robot, ready), exclude=LOOSE)
    said = told("DFKI, design C.1", found)
    print("  ", said["effects"][:3])
    assert cause_names(found)[0] == "coulomb" and members(found) == {"coulomb"}
    assert said["gap_after"] < 0.35 * said["gap_before"] and said["gap_after"] < 0.083  # open loop
    rows = {row["effect"]: row for row in said["effects"]}
    late, weak = rows["actuator_lag"], rows["torque_gain_error"]
    assert said["effects"][:2] == [late, weak] and late["joint"] == [1, 2]
    low, high = late["parameters"]["time"]["interval"]
    assert 0.004 < low[0] < 0.012 < high[0] < 0.02 and 0.025 < low[1] < high[1] < 0.045
    assert weak["joint"] == [1] and weak["parameters"]["error"]["interval"][1][0] < 0.0


def test_a_log_that_says_nothing_of_its_drive_is_refused_in_words(shared):
    record = read_records(shared / "data" / "sage_so101")[0]
    with pytest.raises(NotIdentifiableError, match="neither a command u nor a reference"):
        prepare(record.robot, [record.replace(qd=None)])
