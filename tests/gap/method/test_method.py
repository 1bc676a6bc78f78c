"""Thresholds: every one has a unit and a reason, can be listed, and can be changed by name."""

import dataclasses

import pytest

from clie_blocks.analysis.gap.method import METHOD, Calibration, Method
from clie_blocks.errors import ClieError


def test_every_threshold_has_a_value_a_unit_and_a_reason():
    thresholds = list(METHOD.thresholds())
    assert {one.name.partition(".")[0] for one in thresholds} == {
        field.name for field in dataclasses.fields(Method)}
    for one in thresholds:
        assert one.value is not None and one.unit.strip() and one.reason.strip(), one.name


def test_no_name_is_used_twice():
    names = [one.name for one in METHOD.thresholds()]
    assert len(set(names)) == len(names) > 100


def test_a_changed_method_leaves_the_original_as_it_is():
    changed = METHOD.with_values(**{"search.leaders": 12, "calibration.healthy": 0.7})
    assert changed.search.leaders == 12 and changed.calibration.healthy == 0.7
    assert METHOD.search.leaders == Method().search.leaders != 12
    assert changed.verdict is METHOD.verdict


def test_an_unknown_threshold_is_refused_with_the_nearest_name():
    with pytest.raises(ClieError, match="no threshold is called 'search.leader'; did you mean "
                                        "'search.leaders'"):
        METHOD.with_values(**{"search.leader": 4})


def test_the_method_holds_the_stored_calibration_rather_than_the_one_set_by_hand():
    assert METHOD.calibration != Calibration()
    assert dataclasses.replace(METHOD, calibration=Calibration()).calibration == Calibration()
