"""No false alarm on trials and real logs; what is found there is what is known of them."""

import pytest

from clie_blocks.analysis.records.checks import check_record
from clie_blocks.analysis.records.read import read_records

MISMATCHED = {11}  # practice trials whose velocity filter is not the stated one, by the labels


def found(path):
    return [(f.severity, f.check) for record in read_records(path) for f in check_record(record)]


@pytest.mark.parametrize("number", range(12))
def test_practice_trials_have_no_finding_but_a_wrong_filter(shared, number):
    expected = [("warning", "law.residual")] * 3 if number in MISMATCHED else []
    assert found(shared / f"blind/practice/trial-{number:03d}") == expected


def test_the_emps_logs_are_sound(shared):
    assert found(shared / "data/emps") == []


def test_the_servo_logs_show_saturation_jitter_and_a_filtered_velocity(shared):
    checks = found(shared / "data/bam_xl330")
    assert checks.count(("error", "command.saturated")) == 1
    assert checks.count(("repair", "clock.jitter")) + checks.count(
        ("warning", "clock.jitter")) == 16
    assert {check for severity, check in checks if severity == "error"} == {
        "command.saturated", "excitation.weak"}
    assert checks.count(("warning", "velocity.late")) >= 10


def test_the_double_pendulum_shows_its_late_torque(shared):
    checks = found(shared / "data/dfki_double_pendulum")
    assert ("warning", "torque.late") in checks
    assert {check for severity, check in checks if severity == "error"} == {"excitation.weak"}


def test_the_hobby_arm_has_no_error(shared):
    checks = found(shared / "data/sage_so101")
    assert not [check for check in checks if check[0] == "error"]
    assert ("warning", "signal.quantised") in checks
