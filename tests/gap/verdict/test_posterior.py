"""From evidence to probabilities: what must lead, and what a set must hold."""

import json

import numpy as np
import pytest
from factories import make_row, make_table

from clie_blocks.analysis.gap.calibration.learn import LEARNED
from clie_blocks.analysis.gap.method.calibration import STORED, Calibration, load_calibration
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.verdict.confounders import CONTACT, POSE, UNMARKED
from clie_blocks.analysis.gap.verdict.evidence import Row
from clie_blocks.analysis.gap.verdict.posterior import (
    certainty_of_unfinished,
    credible_set,
    doubted,
    marginals,
    of_unfinished_search,
    posterior,
    probability_of_any,
    verdict,
)
from clie_blocks.errors import ClieError


def weigh(nominal_excess, *rows, violation=0.0, violations=0, free=(), **values):
    table = make_table(nominal_excess, *(make_row(*row) for row in rows), free=free,
                       prior_violation=violation, prior_violations=violations)
    return posterior(table, Calibration(**values))


@pytest.mark.parametrize("said, ranking", [
    ("none", weigh(0.05)),
    ("effect", weigh(100.0, ("coulomb", 0.02, 1), ("spring", 60.0, 1))),
    ("unexplained", weigh(100.0, ("coulomb", 70.0, 1), ("spring", 60.0, 1))),
    ("parametric", weigh(10.0, ("payload", 4.0, 1), violation=9.99, violations=2))])
def test_each_verdict(said, ranking):
    assert verdict(ranking) == said
    assert sum(standing.probability for standing in ranking) == pytest.approx(1.0)


def test_where_no_name_holds_half_the_logs_cannot_tell():
    alike = [(name, 0.02, 1) for name in ("coulomb", "stribeck", "presliding")]
    assert verdict(weigh(100.0, *alike)) == "not_identifiable"
    assert verdict(weigh(100.0, *alike[:2], ("presliding", 60.0, 1))) == "not_identifiable"
    assert verdict(weigh(100.0, alike[0], ("stribeck", 0.05, 1))) == "effect"
    assert verdict(weigh(100.0, *alike), established=True) == "effect"


def test_a_wrong_controller_is_an_effect_however_healthy_the_robot():
    assert verdict(weigh(0.05), established=True) == "effect"


def test_a_free_torque_that_explains_what_the_best_cause_leaves_speaks_of_something_unknown():
    rows = ("spring", 8.0, 1), ("torque_ripple", 9.0, 3)
    assert verdict(weigh(100.0, *rows)) == "effect"
    assert verdict(weigh(100.0, *rows, free=(90.0, 7.9))) == "effect"
    assert verdict(weigh(100.0, *rows, free=(0.3, 7.9))) == "unexplained"


def test_what_a_free_torque_explains_beside_one_cause_counts_though_three_bent_to_explain_half():
    rows = ("coulomb", 9.0, 1), ("stribeck+spring+step_fault", 6.0, 9)
    bent, shown = (weigh(100.0, *rows, free=(40.0, 3.5, left)) for left in (9.0, 1.0))
    unsure, known = (marginals(ranking)["unknown"] for ranking in (shown, bent))
    assert unsure > 0.3 > 0.1 > known
    assert {"unknown", "coulomb"} <= set(credible_set(shown))
    assert "unknown" not in credible_set(bent)


@pytest.mark.parametrize("left, named", [(0.61, False), (6.1, True)])
def test_what_a_healthy_robot_leaves_is_no_gain_of_a_further_cause(left, named):
    whole = 90.0 * left  # the same shares, at the noise and above it
    rows = ("backlash", left, 2), ("backlash+encoder_eccentricity", 0.37 * left, 4)
    assert (marginals(weigh(whole, *rows))["encoder_eccentricity"] > 0.5) == named


def test_what_unseen_data_do_not_bear_out_goes_to_the_unknown():
    ranking = weigh(100.0, ("coulomb", 0.02, 1), ("spring", 60.0, 1))
    assert doubted(ranking, 1.0) == ranking
    halved, none = doubted(ranking, 0.5), doubted(ranking, 0.0)
    before, after = marginals(ranking), marginals(halved)
    assert after["coulomb"] == pytest.approx(0.5 * before["coulomb"])
    assert sum(one.probability for one in halved) == pytest.approx(1.0)
    assert none[0].names == ("unknown",) and none[0].probability == pytest.approx(1.0)
    assert verdict(none) == "unexplained" and credible_set(none) == ["unknown"]


@pytest.mark.parametrize("left, sure", [(0.0, 0.7), (0.25, 0.6), (25.0, 0.502)])
def test_a_search_that_had_to_stop_is_surer_of_causes_that_leave_less_than_a_name_is_worth(
        left, sure):
    ranking = weigh(100.0, ("coulomb", left, 1), ("spring", 60.0, 1))
    assert certainty_of_unfinished(ranking, 100.0, METHOD) == pytest.approx(sure, abs=1e-3)


def test_of_several_causes_that_an_unfinished_search_found_most_are_right():
    alone = weigh(100.0, ("coulomb", 0.02, 1), ("spring", 60.0, 1))
    assert marginals(of_unfinished_search(alone, 0.6)) == pytest.approx(
        marginals(doubted(alone, 0.6)))
    three = ("coulomb+payload+time_delay", 0.02, 3)
    ranking = weigh(1e4, three, ("coulomb+payload", 300.0, 2), ("coulomb", 3000.0, 1))
    unsure = of_unfinished_search(ranking, 0.6)
    before, after = marginals(ranking), marginals(unsure)
    assert sum(one.probability for one in unsure) == pytest.approx(1.0)
    for name in ("coulomb", "payload", "time_delay"):
        assert after[name] == pytest.approx(before[name] * (1.0 - 0.4 / 3), abs=0.02)
    assert after["unknown"] == pytest.approx(0.4, abs=0.03)
    assert unsure[0].names == ("coulomb", "payload", "time_delay")
    assert verdict(unsure) == "effect" and "unknown" in credible_set(unsure)
    assert marginals(of_unfinished_search(ranking, 1.0)) == pytest.approx(before)


def test_causes_beside_a_confounder_keep_their_names_where_some_of_them_explain_most():
    beside = ("coulomb+payload+spring+time_delay", 4.0, 4, 0, POSE, None, 0.0, ("spring",))
    ranking = weigh(2e4, beside, ("payload+time_delay", 150.0, 2), ("payload", 9000.0, 1))
    assert ("coulomb", "payload", "time_delay", "unknown") in [one.names for one in ranking]
    ranking = weigh(2e4, beside, ("payload+time_delay", 9000.0, 2), ("payload", 9000.0, 1))
    assert not any("unknown" in one.names and len(one.names) > 1 for one in ranking)


BUMP = ("torque_ripple", 0.02, 3, 0, POSE)


def test_a_ripple_of_less_than_a_wave_leads_only_where_no_other_bump_would_fit_as_well():
    assert verdict(weigh(1000.0, BUMP, ("spring", 300.0, 1))) == "effect"
    rough = ("torque_ripple", 5.0, 3, 0, POSE)
    assert verdict(weigh(1000.0, rough, ("spring", 300.0, 1))) == "unexplained"
    assert verdict(weigh(1000.0, ("torque_ripple", 5.0, 3), ("spring", 300.0, 1))) == "effect"
    beside = ("spring+torque_ripple", 5.0, 4, 0, POSE)
    assert weigh(4000.0, beside, ("spring", 300.0, 1))[0].names == ("unknown",)
    slight = weigh(16.0, BUMP, ("spring", 9.0, 1))
    assert set(credible_set(slight)) == {"unknown", "torque_ripple"}
    assert marginals(weigh(1000.0, BUMP, ("spring", 0.02, 1)))["spring"] > 0.95


def test_a_fault_where_something_stands_in_the_way_shares_the_set_with_the_unknown():
    fault = ("step_fault", 0.02, 3)
    assert weigh(1000.0, fault)[0].probability > 0.95
    met = weigh(1000.0, (*fault, 0, CONTACT), ("coulomb", 800.0, 1))
    assert verdict(met) == "unexplained"
    assert set(credible_set(met)) == {"unknown", "step_fault"}


@pytest.mark.parametrize("left, names", [
    (50.0, ("coulomb", "payload", "unknown")),  # what the others explain no unknown effect would
    (400.0, ("unknown",))])
def test_something_unknown_in_the_place_of_one_cause_stands_beside_the_others(left, names):
    ranking = posterior(make_table(
        1000.0, make_row("coulomb+payload+torque_ripple", 0.05, 4, confounder=UNMARKED,
                         imitated=("torque_ripple",)),
        make_row("coulomb+payload", left, 2)), Calibration())
    assert ranking[0].names == names and ranking[0].probability > 0.9
    assert verdict(ranking) == "unexplained"
    assert {*credible_set(ranking)} == {*names}


def test_a_soft_stop_differs_from_a_spring_and_a_weight_by_as_much_as_from_a_sine_and_a_spring():
    place = np.linspace(-1.0, 1.0, 2001)  # rad, beyond 1 for longer travels
    for travel in (0.3, 1.0, 2.0):
        stop, q = np.maximum(place, 0.0), travel / 2 * place
        columns = np.stack([np.ones_like(q), q, np.sin(q), np.cos(q)], axis=1)
        left = np.sum((stop - columns @ np.linalg.lstsq(columns, stop)[0]) ** 2)
        assert left / np.sum((stop - stop.mean()) ** 2) > load_calibration().pose_torque_share


def test_a_soft_stop_differs_from_a_sine_by_the_share_that_the_verdict_counts_on():
    place = np.linspace(-1.0, 1.0, 2001)
    stop = np.maximum(place, 0.0)

    def left(order, *others):
        columns = np.stack([np.ones_like(place), np.sin(order * place), np.cos(order * place),
                            *others], axis=1)
        return np.sum((stop - columns @ np.linalg.lstsq(columns, stop)[0]) ** 2)

    whole = np.sum((stop - stop.mean()) ** 2)
    orders = np.linspace(0.1, np.pi, 40)  # up to one wave
    least = min(left(order, place) for order in orders) / whole
    for calibration in (load_calibration(), Calibration()):
        assert calibration.pose_torque_share == pytest.approx(least, rel=0.1)
    assert min(left(order) for order in orders) / whole == pytest.approx(0.012, rel=0.05)


def test_a_free_torque_beside_no_cause_competes_with_the_likeliest_not_with_the_longest_list():
    """A third cause that lowers the excess a little makes nothing unknown more likely."""
    one, three = ("coulomb", 4e4, 1), ("coulomb+gravity+spring", 2.4e4, 6)
    alone, beside = (next(s.probability for s in weigh(1e6, *rows, free=(7e3, 7e3))
                          if s.names == ("unknown",)) for rows in ((one,), (one, three)))
    assert beside <= alone < 0.2


def test_causes_that_leave_the_same_share_the_set_and_a_second_cause_must_earn_its_place():
    ranking = weigh(100.0, ("coulomb", 0.02, 1), ("stribeck", 0.02, 1),
                    ("coulomb+spring", 0.019, 2))
    assert set(credible_set(ranking)) == {"coulomb", "stribeck"}
    assert marginals(ranking)["spring"] < 0.1


@pytest.mark.parametrize("nothing", [5.0, 100.0, 2600.0, 1e6])
def test_where_a_further_cause_is_futile_it_does_not_lead_though_it_leaves_nothing(nothing):
    for left in nothing * np.geomspace(1e-6, 1.0, 60):
        ranking = weigh(nothing, ("coulomb", left, 1), ("coulomb+spring", 0.0, 2),
                        contamination=0.0)
        odds = {s.names: s.probability for s in ranking}
        share = odds["coulomb", "spring"] / (odds["coulomb", "spring"] + odds["coulomb",])
        if Calibration().cannot_pay_off(left, nothing):
            assert share < 0.011
        else:
            assert share > 0.009


@pytest.mark.parametrize("nothing", np.geomspace(0.5, 20.0, 12))
def test_where_no_two_causes_can_lead_none_does_though_they_leave_nothing(nothing):
    for left in nothing * np.linspace(0.05, 1.0, 20):
        ranking = weigh(nothing, ("coulomb", left, 1), ("coulomb+spring", 0.0, 2),
                        contamination=0.0)
        odds = {s.names: s.probability for s in ranking}
        share = odds["coulomb", "spring"] / (odds["coulomb", "spring"] + odds["none",])
        if Calibration().cannot_lead(left, nothing):
            assert share < 0.011
        else:
            assert share > 0.005


def test_two_causes_may_lead_beside_a_large_gap_and_not_beside_a_healthy_robot():
    healthy = Calibration().healthy
    assert Calibration().cannot_lead(1.05 * healthy, 1.1 * healthy)
    assert not Calibration().cannot_lead(50.0, 100.0)


def test_the_score_falls_by_the_sharpness_per_factor_e_above_what_a_right_model_may_leave():
    c = Calibration(sharpness=6.0, floor=0.05, misfit=1e-3)
    tolerated = 0.05 + 1e-3 * 200.0
    assert c.score(0.0, 200.0) - c.score((np.e - 1.0) * tolerated, 200.0) == pytest.approx(6.0)
    assert c.score(-3.0, 200.0) == c.score(0.0, 200.0) and c.score(1.0, -5.0) == c.score(1.0, 0.0)
    excess = np.array([0.0, 1.0, 7.0])
    np.testing.assert_allclose(c.score(excess, 50.0), [c.score(one, 50.0) for one in excess])


def test_where_nothing_is_left_a_further_cause_is_futile():
    assert Calibration().cannot_pay_off(0.0, 0.0) and Calibration().cannot_pay_off(
        -0.1, -0.1)


def test_two_causes_lead_where_one_leaves_much():
    ranking = weigh(100.0, ("coulomb", 20.0, 1), ("spring", 70.0, 1), ("coulomb+spring", 0.02, 2))
    assert ranking[0].names == ("coulomb", "spring")


def test_a_gain_that_leaves_numbers_beyond_the_datasheet_is_no_better_than_wrong_numbers():
    gain = ("torque_gain_error", 0.0, 1)
    assert weigh(0.5, gain, violation=0.5, violations=1)[0].names == ("torque_gain_error",)
    assert weigh(0.5, (*gain, 1), violation=0.5, violations=2)[0].names == ("parametric",)


def test_numbers_beyond_the_datasheet_are_not_healthy_however_little_they_matter():
    assert weigh(0.02, violation=0.02, violations=2)[0].names == ("parametric",)


def test_a_cause_that_brings_the_numbers_home_with_fewer_leads_where_both_leave_the_same():
    gain = ("torque_gain_error", 1.57, 1)
    assert weigh(2.45, gain, violation=0.88, violations=2)[0].names == ("torque_gain_error",)
    assert weigh(2.45, (*gain, 1), violation=0.88, violations=2)[0].names == ("parametric",)
    two = weigh(2.45, ("stribeck", 1.57, 2), violation=0.88, violations=1)
    assert two[0].names == ("parametric",)


def test_where_the_best_cause_leaves_much_causes_are_told_apart_less_surely():
    near, far = (weigh(whole, ("presliding", 0.2 * size, 1), ("stribeck", 0.5 * size, 1))
                 for whole, size in ((10.0, 1.0), (1e6, 1e4)))
    assert near[0].names == far[0].names == ("presliding",)
    assert near[0].probability > 0.95 and far[0].probability == pytest.approx(0.8, abs=0.01)
    assert credible_set(near) == ["presliding"] and credible_set(far) == ["presliding", "stribeck"]
    together = [sum(s.probability for s in found if s.names[0] in ("presliding", "stribeck"))
                for found in (near, far)]
    assert together == pytest.approx([1.0, 1.0], abs=0.02)


@pytest.mark.parametrize("uncertainty", [0.0, 0.3])
def test_how_much_less_surely_is_a_value_of_the_calibration(uncertainty):
    far = weigh(1e6, ("presliding", 2e3, 1), ("stribeck", 5e4, 1),
                leader_uncertainty=uncertainty, contamination=0.0)
    assert far[0].names == ("presliding",)
    assert far[0].probability == pytest.approx(1.0 - uncertainty, abs=1e-3)


def test_what_the_leading_cause_gives_away_goes_to_its_nearest_alternative():
    rows = ("presliding", 2e3, 1), ("stribeck", 4e3, 1), ("spring", 4e4, 1)
    sure, unsure = (weigh(1e6, *rows, leader_uncertainty=uncertainty, contamination=0.0)
                    for uncertainty in (0.0, 0.3))
    gained = {row.names[0]: row.probability - next(
        other.probability for other in sure if other.names == row.names) for row in unsure}
    assert gained["stribeck"] == pytest.approx(-gained["presliding"], rel=1e-3) and (
        gained["stribeck"] > 0.2)


def test_a_stored_calibration_of_another_schema_is_refused(tmp_path):
    kept = json.loads(STORED.read_text())
    assert set(LEARNED) <= set(kept["values"])
    assert load_calibration() == Calibration(**kept["values"])
    other = tmp_path / "calibration.json"
    other.write_text(json.dumps({**kept, "schema_version": 3}))
    with pytest.raises(ClieError, match="schema 3.*calibration.learn"):
        load_calibration(other)
    assert load_calibration(tmp_path / "none.json") == Calibration()


def test_a_number_of_the_file_that_explains_as_much_as_an_effect_stands_beside_it():
    ranking = weigh(100.0, ("payload", 0.02, 1), ("parametric", 0.02, 1))
    assert verdict(ranking) == "effect"
    assert credible_set(ranking) == ["payload", "parametric"]


def test_a_number_of_the_file_that_explains_more_with_less_comes_first():
    ranking = weigh(100.0, ("payload+spring", 0.5, 2), ("parametric", 0.02, 1))
    assert verdict(ranking) == "parametric" and credible_set(ranking) == ["parametric"]


def test_an_effect_beside_a_wrong_number_is_an_effect():
    ranking = weigh(100.0, ("parametric+spring", 0.02, 2), ("spring", 30.0, 1),
                    ("parametric", 20.0, 1))
    assert ranking[0].names == ("parametric", "spring") and verdict(ranking) == "effect"


def test_parameters_outside_their_tolerance_count_once_whatever_their_form():
    ranking = weigh(10.0, ("parametric", 0.05, 1), violation=9.99, violations=2)
    assert [one.names for one in ranking].count(("parametric",)) == 1


COUPLED = Row(("coupling",), 5.0, 1.0, prior_violations=1, prior_violation=4.99)


def test_a_joint_model_stated_wrong_stands_beside_a_cause_as_it_does_alone():
    """What the datasheet costs is no gap, so that no effect is needed that passes for it."""
    weak = make_row("coupling+torque_gain_error", 0.5, 2)
    ranking = posterior(make_table(200.0, COUPLED, weak), Calibration())
    assert marginals(ranking)["parametric"] > 0.9 > 0.1 > marginals(ranking)["torque_gain_error"]
    assert ranking[0].names == ("coupling", "parametric") and verdict(ranking) == "effect"
    assert ranking[0].excess == pytest.approx(0.01)


def test_an_effect_that_keeps_to_the_datasheet_leads_a_wrong_joint_model_that_does_as_well():
    weak = make_row("coupling+torque_gain_error", 0.01, 2)
    ranking = posterior(make_table(200.0, COUPLED, weak), Calibration())
    assert ranking[0].names == ("coupling", "torque_gain_error")


def test_of_two_wrong_numbers_beside_a_cause_the_better_one_stays():
    for left, right in ((0.5, 0.01), (0.0, 0.0)):
        geared = make_row("coupling+parametric", left, 2)
        ranking = posterior(make_table(200.0, COUPLED, geared), Calibration())
        beside = [one for one in ranking if one.names == ("coupling", "parametric")]
        assert [one.excess for one in beside] == [pytest.approx(right)]


def test_a_hypothesis_that_holds_two_of_some_names_counts_once():
    ranking = weigh(100.0, ("spring+gravity", 0.05, 2), ("spring", 0.3, 1), ("gravity", 0.3, 1))
    of_name = marginals(ranking)
    together = probability_of_any(ranking, ("spring", "gravity"))
    assert of_name["spring"] + of_name["gravity"] > 1.0 >= together
    assert together == pytest.approx(1.0 - sum(
        one.probability for one in ranking if one.names in (("none",), ("unknown",),
                                                            ("parametric",))))
