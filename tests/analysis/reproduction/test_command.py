"""The paper's results: verdicts follow from the numbers, and the numbers are the known ones."""

import functools
import json

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.reproduction import command
from clie_blocks.analysis.reproduction.document import headline
from clie_blocks.analysis.reproduction.items import (
    ERRATUM,
    MISSED,
    PICTURE,
    REPRODUCED,
    UNSTATED,
    Item,
    bound_items,
    figure_3_items,
    table_3_items,
)
from clie_blocks.analysis.reproduction.runs import (
    READINGS,
    estimates,
    signed_mean_error,
    tracking_mse,
)


@pytest.fixture(scope="module")
def bounds():
    return bound_items()


@pytest.mark.parametrize("ours, literal, erratum, verdict", [
    (1.004, True, "", REPRODUCED), (1.004, False, "", UNSTATED), (1.1, True, "k_1", ERRATUM),
    (1.1, True, "", MISSED), (1.1, False, "", MISSED)])
def test_verdict_follows_from_the_difference(ours, literal, erratum, verdict):
    item = Item("x", "y", (1.0,), (ours,), 5e-3, literal=literal, erratum=erratum)
    assert item.verdict == verdict
    assert item.difference == pytest.approx((ours - 1.0,))


def test_a_picture_has_no_verdict():
    assert Item("Fig. 3", "y", (), (1.0,), 0.0).verdict == PICTURE


def test_bounds_are_as_printed_but_for_the_errata(bounds):
    found = {(item.place, item.name, item.reading): item.verdict for item in bounds}
    assert all(verdict == REPRODUCED for (place, _, _), verdict in found.items()
               if place in ("section 5.1", "(18)", "(31)", "(46)"))
    assert found["Theorem 2", "k_1", "as defined"] == ERRATUM
    assert found["Theorem 2", "k_1", "K_bar without its -I"] == UNSTATED
    assert found["Theorem 4", "k_3, CASE 2", "as defined"] == ERRATUM


@functools.cache
def row_of(case, reading=-1):
    """Estimates of a row of Table 2 under a reading."""
    return estimates(READINGS[reading], case, [0])[0]


def test_row_of_case_1_holds_only_under_the_fitted_reading():
    fitted = READINGS[-1]
    assert not fitted.literal and not fitted.noisy
    row = row_of(1)
    np.testing.assert_allclose(row, paper.THETA_HAT[1], atol=4e-4)
    assert np.max(np.abs(row_of(1, reading=0) - paper.THETA_HAT[1])) > 0.1


@pytest.mark.parametrize("case", [2, 3])
def test_rows_of_case_2_and_3_do_not_follow(case):
    row = row_of(case)
    assert np.max(np.abs(row - paper.THETA_HAT[case])) > 4e-4
    shift = row - row_of(1)
    printed = paper.THETA_HAT[case] - paper.THETA_HAT[1]
    assert np.all(shift[:2] < 0) and np.all(printed[:2] > 0)  # the opposite sign


def test_validation_mean_squares_have_the_printed_mantissas_a_thousand_times_larger():
    plus, minus = tracking_mse(1), tracking_mse(1, printed_sign=True)
    np.testing.assert_allclose(plus / paper.TRACKING_MSE_PRINTED[1], 1000, rtol=3e-4)
    np.testing.assert_allclose(minus, [1.678e-4, 9.33e-4], rtol=1e-3)


def test_printed_mean_of_eps_is_far_from_a_telescoping_mean():
    assert np.all(np.abs(signed_mean_error(1)) < 0.1 * np.abs(paper.EPS_MEAN[1]))


def test_fig_3_shows_the_counterexample():
    last = figure_3_items()[-1]
    weighted, smallest, weighted_without, smallest_without = last.ours
    assert weighted == pytest.approx(4.2479, abs=2e-4) and smallest > 0.02
    assert weighted_without > 3 and abs(smallest_without) < 1e-9


@pytest.mark.slow
def test_reproduce_writes_report_and_json(tmp_path, capsys):
    assert command.main(["--seeds", "1", "--json", "-o", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema_version"] == 1 and len(found["errata"]) == 29
    rows = {(item["name"], item["verdict"]) for item in found["items"]
            if item["place"] == "Table 2"}
    assert ("CASE 1", UNSTATED) in rows
    assert {name for name, verdict in rows if verdict != MISSED} == {"CASE 1"}
    page = (tmp_path / "reproduction.html").read_text()
    assert "Content-Security-Policy" in page and page.count("<svg") == 3
    assert "| reading | a1 |" in (tmp_path / "reproduction.md").read_text()


def test_the_headline_says_what_agrees_and_what_does_not(bounds):
    agree, unstated, contradict, missed = headline([*bounds, *table_3_items()])
    assert agree.startswith("Agree as printed (10): ") and "mu_0 of (18)" in agree
    assert "k_1 of Theorem 2" in unstated and "k_1 of Theorem 2" in contradict
    assert "mean of eps" in missed and "mean of eps" not in agree + unstated + contradict


def test_no_seed_is_refused():
    with pytest.raises(Exception, match="at least 1"):
        command.main(["--seeds", "0"])
