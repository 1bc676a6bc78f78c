"""Shares of several causes: closed forms of Shapley's value."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.assessment.cause_shares import cause_shares

NAMES = ("backlash", "coulomb", "gravity")
SETS = [frozenset(some) for count in range(4) for some in itertools.combinations(NAMES, count)]


def left_by(taken):
    """Excess of each set, of 100 of the nominal model."""
    return {some: 100.0 * (1.0 - taken(some)) for some in SETS}


def test_causes_that_do_not_meet_take_what_they_take_alone():
    own = {"backlash": 0.5, "coulomb": 0.3, "gravity": 0.1}
    shares = cause_shares(NAMES, left_by(lambda some: sum(own[k] for k in some)))
    for name, share in shares.items():
        assert (share.alone, share.last, share.mean) == pytest.approx((own[name],) * 3)


def test_causes_that_do_the_same_share_it():
    shares = cause_shares(NAMES, left_by(
        lambda some: 0.9 if {"backlash", "coulomb"} & some else 0.0))
    for name in ("backlash", "coulomb"):
        assert shares[name].alone == pytest.approx(0.9)
        assert shares[name].last == pytest.approx(0.0, abs=1e-12)
        assert shares[name].mean == pytest.approx(0.45)
    assert shares["gravity"].mean == pytest.approx(0.0, abs=1e-12)


def test_causes_that_need_each_other_share_what_both_take():
    both = {"backlash", "coulomb"}
    shares = cause_shares(sorted(both), left_by(lambda some: 0.8 if both <= some else 0.0))
    assert [(one.alone, one.last, one.mean) for one in shares.values()] == [
        pytest.approx((0.0, 0.8, 0.4))] * 2


def test_a_set_that_was_not_fitted_takes_what_its_best_part_does():
    left = left_by(lambda some: 0.2 * len(some))
    del left[frozenset({"backlash", "coulomb"})]
    shares = cause_shares(NAMES, left)
    assert shares["gravity"].last == pytest.approx(0.4)
    assert sum(one.mean for one in shares.values()) == pytest.approx(0.6)


@given(st.lists(st.floats(0.0, 150.0), min_size=8, max_size=8))
def test_the_mean_shares_add_up_to_what_all_take_together(excesses):
    left = dict(zip(SETS, excesses))
    left[frozenset()] = max(left[frozenset()], 1.0)
    shares = cause_shares(NAMES, left)
    least = min(left.values())
    assert sum(one.mean for one in shares.values()) == pytest.approx(
        1.0 - min(least / left[frozenset()], 1.0), abs=1e-9)
    assert all(one.mean >= -1e-12 and 0.0 <= one.alone <= 1.0 for one in shares.values())
    assert np.isfinite([one.last for one in shares.values()]).all()
