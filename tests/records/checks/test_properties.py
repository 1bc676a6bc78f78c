"""Properties of the checks: what they find does not depend on names, order, units or size."""

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.records.checks import check_record, fix_units

DEGREE = 180 / np.pi
few = settings(max_examples=12, deadline=None)
orders = st.permutations(range(3)).filter(lambda order: list(order) != [0, 1, 2])


def reordered(record, order):
    """The same log with its joints, and what is known of them, in another order."""
    order = list(order)
    robot = record.robot

    def section(part):
        values = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
        return dataclasses.replace(part, **{
            name: value[order] for name, value in values.items()
            if isinstance(value, np.ndarray) and value.shape == (3,)})

    joints = [record.joints[k] for k in order]
    return record.replace(
        joints=joints, **{name: getattr(record, name)[:, order] for name in record.signals},
        robot=dataclasses.replace(robot, joints=joints, motor=section(robot.motor),
                                  controller=section(robot.controller),
                                  encoder=section(robot.encoder)))


def with_column(record, signal, k, change):
    x = getattr(record, signal).copy()
    x[:, k] = change(x[:, k])
    return record.replace(**{signal: x})


def told(findings):
    return sorted((f.check, f.joint or "", f.what) for f in findings)


def test_permuted_columns_are_found_with_their_permutation(clean):
    @few
    @given(order=orders, signal=st.sampled_from(["u", "dq"]))
    def holds(order, signal):
        wrong = clean.replace(**{signal: getattr(clean, signal)[:, list(order)]})
        found = [f for f in check_record(wrong) if f.check.endswith(".swapped")]
        assert len(found) == 1
        assert str([k + 1 for k in order]) in found[0].what + found[0].fix

    holds()


def test_degrees_are_found_on_any_joint_and_undone(clean):
    @few
    @given(k=st.integers(0, 2), signal=st.sampled_from(["dq", "q"]))
    def holds(k, signal):
        wrong = with_column(clean, signal, k, lambda x: x * DEGREE)
        found = [f for f in check_record(wrong) if f.check == "units.velocity"]
        assert [f.joint for f in found] == [clean.joints[k]]
        assert np.allclose(getattr(fix_units(wrong, found), signal), getattr(clean, signal))

    holds()


def test_wrong_time_units_are_named(clean):
    @few
    @given(unit=st.sampled_from([("ms", 1e3), ("us", 1e6), ("ns", 1e9)]),
           start=st.floats(-1e3, 1e3))
    def holds(unit, start):
        name, factor = unit
        found = check_record(clean.replace(time=(clean.time + start) * factor))
        assert [f.check for f in found if f.severity == "error"] == ["clock.unit"]
        assert f"--time-unit {name}" in found[0].fix

    holds()


def test_the_order_of_the_joints_does_not_change_what_is_found(clean):
    wrong = with_column(with_column(clean, "dq", 0, lambda x: 1.2 * x), "u", 1, np.negative)
    expected = told(check_record(wrong))

    @few
    @given(order=orders)
    def holds(order):
        assert told(check_record(reordered(wrong, order))) == expected

    assert len(expected) >= 2
    holds()


def test_wrong_gains_are_found_with_the_true_ones(clean):
    @few
    @given(k=st.integers(0, 2), factor=st.sampled_from([0.25, 0.5, 0.9, 1.1, 2.0, 4.0]))
    def holds(k, factor):
        kp = clean.robot.controller.kp.copy()
        kp[k] *= factor
        controller = dataclasses.replace(clean.robot.controller, kp=kp)
        robot = dataclasses.replace(clean.robot, controller=controller)
        found = [f for f in check_record(clean, robot) if f.check == "law.gain"]
        assert [f.joint for f in found] == [clean.joints[k]]
        true = clean.robot.controller.kp[k]
        said = float(found[0].what.split("Kp = ")[1].split(" ")[0])
        assert abs(said / true - 1) < 1e-3

    holds()


def test_shift_in_time_and_mirror_change_nothing(clean):
    mirrored = clean.replace(**{name: -getattr(clean, name) for name in clean.signals})
    assert check_record(mirrored) == []
    assert check_record(clean.replace(time=clean.time + 77.0)) == []
