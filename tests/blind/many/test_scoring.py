"""How answers on robots with several effects count."""

import pytest

from clie_blocks.analysis.blind.many.scoring import score, terminal_lines

LABEL = {"robot": "arm of 2", "labels": ["coulomb", "backlash", "time_delay"],
         "shares": {"coulomb": 0.6, "backlash": 0.3, "time_delay": 0.02},
         "gap": {"true_model": 1e-4}}


def answer(*causes, unexplained=False, before=3e-4, after=1e-4):
    return {"effects": [{"effect": name, "joint": [1], "probability": probability,
                         "share": {"alone": mean, "last": mean, "mean": mean}}
                        for name, probability, mean in causes],
            "set_90": [name for name, *_ in causes], "unexplained": unexplained,
            "gap_before": before, "gap_after": after, "seconds": 1.0}


def row_of(diagnosis):
    board = score({"trial-000": diagnosis}, {"trial-000": LABEL}, str)
    return board, board["rows"][0]


def test_a_right_answer_needs_no_effect_that_hardly_shows():
    board, row = row_of(answer(("backlash", 0.99, 0.3), ("coulomb", 0.98, 0.6)))
    assert (board["precision"]["rate"], board["recall"]["rate"]) == (1.0, 1.0)
    assert row["order"] and row["largest_first"]
    assert row["closed"] == pytest.approx(1.0)


def test_order_is_that_of_the_shares_and_false_names_lower_the_precision():
    board, row = row_of(answer(("coulomb", 0.99, 0.2), ("backlash", 0.98, 0.5),
                               ("spring", 0.9, 0.1)))
    assert board["precision"]["hits"] == 2 and board["precision"]["of"] == 3
    assert row["order"] is False and not row["largest_first"]


def test_what_has_less_than_half_the_probability_is_not_named():
    board, row = row_of(answer(("unknown", 0.6, 0.0), ("coulomb", 0.4, 0.6), unexplained=True,
                               after=2e-4))
    assert board["precision"]["rate"] is None and board["recall"]["hits"] == 0
    assert row["order"] is None and row["unexplained"]
    assert row["closed"] == pytest.approx((9 - 4) / (9 - 1))


def test_a_name_that_the_logs_do_not_tell_from_the_truth_is_right():
    diagnosis = answer(("stribeck", 0.99, 0.6))
    diagnosis["effects"][0]["alike"] = ["coulomb"]
    board, _ = row_of(diagnosis)
    assert board["precision"]["rate"] == 1.0 and board["recall"]["hits"] == 1


def test_friction_that_varies_over_the_position_names_the_coulomb_friction_in_it():
    """And the order is that of what is named: the two are one cause of the answer."""
    diagnosis = answer(("position_dependent_friction", 0.9, 0.8), ("backlash", 0.9, 0.3))
    diagnosis["effects"][0]["share"].update(simpler="coulomb", as_simpler=0.7)
    _, row = row_of(diagnosis)
    assert [one["effect"] for one in row["truth"] if one["named"]] == ["coulomb", "backlash"]
    assert row["order"] and row["largest_first"]
    assert not row["named"][0]["true"]  # the robot does not have what varies
    diagnosis["effects"][0]["share"]["as_simpler"] = 0.01
    _, row = row_of(diagnosis)
    assert [one["effect"] for one in row["truth"] if one["named"]] == ["backlash"]


def test_names_that_are_alike_share_their_probability():
    diagnosis = answer(("coulomb", 0.45, 0.6), ("stribeck", 0.45, 0.6))
    for row, other in zip(diagnosis["effects"], ("stribeck", "coulomb")):
        row.update(alike=[other], together=0.9)
    board, row = row_of(diagnosis)
    assert board["recall"]["hits"] == 1 and [one["effect"] for one in row["named"]] == ["coulomb"]


def test_names_of_one_class_count_once():
    """Three effects of two classes: there is no third largest."""
    friction = {"coulomb": "friction", "backlash": "friction"}
    board = score({"trial-000": answer(("coulomb", 0.99, 0.6))}, {"trial-000": LABEL},
                  lambda name: friction.get(name, name))
    assert [one["effect"] for one in board["rows"][0]["truth"]] == ["friction", "time_delay"]
    assert [figure["of"] for figure in board["recall_by_rank"]] == [1, 0, 0]


def test_a_trial_that_failed_names_nothing():
    board, _ = row_of({"error": "too short", "exit_code": 4})
    assert board["failed"] == ["trial-000"] and board["recall"]["rate"] == 0.0
    assert "of 2" in "\n".join(terminal_lines({"command": "clie blind --many 1", **board}))
