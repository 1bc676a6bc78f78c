"""The verdict in words: from answers, without a diagnosis."""

import pytest

from clie_blocks.analysis.gap.report.causes import SEPARATED_BY, alternatives_section
from clie_blocks.analysis.gap.report.in_short import _how_sure, in_short
from clie_blocks.analysis.gap.report.overview import overview
from clie_blocks.analysis.gap.report.summary import (
    headline,
    summary_line,
    summary_lines,
    terminal_lines,
)
from clie_blocks.analysis.gap.report.wording import CONFOUNDERS
from clie_blocks.analysis.gap.verdict.confounders import CONTACT, POSE, UNMARKED
from clie_blocks.analysis.report.render import html


def row(name, probability, joint=(1,), **more):
    """Row of an effect in an answer."""
    return {"effect": name, "joint": joint and list(joint), "probability": probability, **more}


def answer_of(verdict, *effects, joints=(), value=96.4, unseen=True, **more):
    """Answer with the given rows, for robots whose joints have names."""
    return {"verdict": verdict, "effects": list(effects), "set_90": [], "where": {
        "joint": [{"name": name, "share": 0.5} for name in joints]},
        "closed_percent": {"value": value, "unseen_data": unseen, "interval": None}, **more}


def test_a_headline_names_cause_joint_and_reduction():
    found = answer_of("effect", row("coulomb", 0.93, [2]), row("unknown", 0.07, None),
                      joints=("shoulder", "elbow"))
    assert headline(found) == (
        "The model is missing coulomb at elbow (93 %). Adding it removes 96 % of the reducible "
        "gap on unseen data.")
    assert headline({**found, "families": {"friction": 0.97}}) == headline(found)
    one_of_many = {**found, "families": {"friction": 0.97},
                   "effects": [row("coulomb", 0.5, [2])]}
    assert "coulomb at elbow (50 %; friction of some kind 97 %). Adding it" in headline(
        one_of_many
    )
    two = {**found, "effects": [row("coulomb", 0.93, [2]), row("payload", 0.9, None)]}
    assert "coulomb at elbow (93 %) and payload (90 %). Adding them removes" in headline(two)
    assert headline({**found, "verdict": "none"}).endswith("down to the sensor noise.")


def test_names_that_the_logs_do_not_tell_apart_are_one_answer():
    spring = row("spring", 0.6, [2], alike=["gravity"], together=0.99)
    gravity = row("gravity", 0.39, [2], alike=["spring"], together=0.99)
    found = answer_of("effect", spring, gravity, joints=("shoulder", "elbow"))
    assert headline(found) == (
        "The model is missing spring at elbow or gravity (99 %; these logs do not tell them "
        "apart). Adding it removes 96 % of the reducible gap on unseen data.")
    even = {**found, "effects": [{**spring, "probability": 0.49, "together": 0.97},
                                 {**gravity, "probability": 0.48, "together": 0.97}]}
    assert "missing spring at elbow or gravity (97 %;" in headline(even)


def test_a_cause_that_is_alike_with_a_wrong_number_is_no_finding_of_either():
    gain = row("torque_gain_error", 0.7, [1], alike=["parametric"], together=0.99)
    number = row("parametric", 0.29, None, alike=["torque_gain_error"], together=0.99)
    assert headline(answer_of("not_identifiable", gain, number, value=None)) == (
        "These logs do not identify the cause: torque gain error at joint 1 or parameters outside "
        "their tolerance (99 %; these logs do not tell them apart).")


def test_numbers_that_the_logs_do_not_tell_apart_are_alternatives():
    def off(key, identified, stated, alternative, joint=1):
        return {"key": key, "joint": joint, "identified": identified, "stated": stated,
                "unit": "1", "note": "", "probability": 0.9, "alternative": alternative}

    rows = [off("links.mass_kg", 2.0, 1.0, 1), off("links.mass_kg", 3.0, 2.0, 1, joint=2),
            off("motor.gear_ratio", 8.0, 10.0, 2)]
    found = answer_of("parametric", row("parametric", 0.9, None), description=rows, value=None,
                      joints=("shoulder", "elbow"))
    assert headline(found) == (
        "The numbers of robot.toml are off: links.mass_kg of shoulder is 2, stated 1 and "
        "links.mass_kg of elbow is 3, stated 2, or motor.gear_ratio of shoulder is 8, stated 10 "
        "(these logs do not tell them apart).")
    alone = {**found, "description": rows[:1]}
    assert headline(alone) == (
        "The numbers of robot.toml are off: links.mass_kg of shoulder is 2, stated 1.")


def test_joints_without_a_name_are_numbered():
    found = answer_of("effect", row("coulomb", 0.93, [1, 2]))
    assert "coulomb at joint 1 and joint 2 (93 %)" in headline(found)


def test_a_gap_that_grows_is_said_to_grow():
    found = answer_of("effect", row("coulomb", 0.93), value=-30.4)
    assert headline(found).endswith("Adding it enlarges the reducible gap by 30 % on unseen data.")


def test_the_data_of_the_reduction_is_named():
    found = answer_of("effect", row("coulomb", 0.93), unseen=False)
    assert headline(found).endswith("gap on the data used for the fit.")


def test_the_set_is_named_where_no_effect_is_likely():
    found = answer_of("not_identifiable", row("coulomb", 0.4),
                      set_90=["coulomb", "stribeck", "presliding"])
    assert headline(found).startswith(
        "These logs do not identify the cause: coulomb, stribeck or presliding. Adding the most "
        "likely cause removes 96 %")
    unknown = {**found, "set_90": ["coulomb", "unknown"]}
    assert "coulomb or an effect outside the library." in headline(unknown)


def test_a_family_is_named_where_no_effect_is_likely():
    found = answer_of("not_identifiable", row("unknown", 0.1, None), row("coulomb", 0.4, [2]),
                      joints="ab", value=None, set_90=["coulomb", "stribeck", "spring"],
                      families={"friction": 0.7, "load": 0.2})
    assert headline(found) == (
        "These logs do not identify the cause: friction of some kind (70 %), most likely coulomb "
        "at b (40 %).")
    assert "coulomb, stribeck or spring" in headline({**found, "families": {"load": 0.4}})


def test_no_family_is_named_where_an_effect_of_another_is_as_likely():
    found = answer_of("not_identifiable", row("torque_gain_error", 0.498), row("payload", 0.496),
                      value=None, set_90=["torque_gain_error", "payload"],
                      families={"load": 0.502, "drive": 0.498})
    assert headline(found) == (
        "These logs do not identify the cause: torque gain error or payload.")


def test_parameter_errors_are_named_with_what_is_stated():
    found = answer_of("parametric", joints="ab", value=0.0, joint_model={
        "inertia": {"value": [0.02, 0.05], "stated": [0.02, 0.04], "unit": "kg m^2",
                    "tolerance": [1e-4, 4e-4]},
        "damping": {"value": [0.2, 0.21], "stated": [0.1, 0.2], "unit": "N m s/rad",
                    "tolerance": [0.015, 0.03]},
        "load": {"value": [0.0, 0.0], "stated": [0.0, 0.001], "unit": "N m",
                 "tolerance": [1.0, 1e-4]}})
    assert headline(found) == (
        "The model structure is right, but parameters are outside their tolerance: inertia at b "
        "0.05 kg m^2, stated 0.04; offset at b 0 N m, stated 0.001; damping at a 0.2 N m s/rad, "
        "stated 0.1.")
    assert headline({**found, "joint_model": {}}) == (
        "The model structure is right, but parameters are outside their tolerance.")


def test_an_unexplained_gap_names_the_closest_effect_and_what_is_certain():
    found = answer_of("unexplained", row("unknown", 0.9, None), value=70.0)
    assert headline(found) == ("No effect in the library explains the gap. Adding the closest "
                               "effect removes 70 % of the reducible gap on unseen data.")
    found["effects"] += [row("actuator_lag", 0.97), row("coulomb", 0.03)]
    assert headline(found).startswith(
        "The model is missing actuator lag at joint 1 (97 %), and something more that no effect "
        "in the library explains.")
    assert "coulomb" not in headline(found)


def test_causes_that_are_named_beside_something_unknown_are_what_is_added():
    found = answer_of("unexplained", row("unknown", 0.99, None), row("coulomb", 0.98, [1]),
                      row("payload", 0.97, [1, 2]), value=70.0,
                      closest=[{"effect": "coulomb", "joint": [1]},
                               {"effect": "payload", "joint": [1, 2]}])
    assert headline(found) == (
        "The model is missing coulomb at joint 1 (98 %) and payload at joint 1 and joint 2 "
        "(97 %), and something more that no effect in the library explains. Adding them removes "
        "70 % of the reducible gap on unseen data.")


def test_a_law_that_did_not_run_is_no_closest_effect():
    found = answer_of("unexplained", value=99.0, controller_as_stated=False)
    assert headline(found) == (
        "No effect in the library explains the gap, and the stated control law is not the one "
        "that ran. Replacing the control law by the one that ran removes 99 % of the reducible "
        "gap on unseen data.")


def test_what_is_sure_is_no_alternative():
    found = answer_of(
        "effect", row("time_delay", 0.96), row("coulomb", 0.6), row("stribeck", 0.3),
        set_90=["time_delay", "coulomb", "stribeck"], next_experiment=None)
    section = alternatives_section(found)
    assert "cannot separate coulomb and stribeck:" in section.sentences[0]
    assert "given time delay" in section.sentences[0]
    assert "No experiment" in section.sentences[0] and len(section.tables) == 1
    found["next_experiment"] = {"best": {"experiment": "chirp"}, "menu": [
        {"experiment": "chirp", "expected_set_size": 1.2, "least_distance": 40.0}]}
    section = alternatives_section(found)
    assert "No experiment" not in section.sentences[0] and len(section.tables) == 2


def test_one_cause_beside_nothing_has_a_run_of_its_own():
    found = answer_of("effect", row("coulomb", 0.6), set_90=["coulomb", "none"],
                      next_experiment={
                          "separates": [["coulomb"], ["none"]],
                          "best": {"experiment": "chirp"}, "menu": [
                              {"experiment": "chirp", "expected_set_size": 1.2,
                               "least_distance": 40.0}]})
    section = alternatives_section(found)
    assert section.sentences[0].startswith(
        "These logs cannot separate coulomb from no effect.")
    assert len(section.tables) == 1


def test_beside_something_unknown_no_experiment_was_simulated():
    names = ["coulomb", "stribeck", "unknown"]
    found = answer_of("not_identifiable", *(row(name, 0.3) for name in names), set_90=names,
                      next_experiment=None)
    text = alternatives_section(found).sentences[0]
    assert "while something unknown remains" in text and "was simulated" not in text


def test_pairs_without_an_experiment_of_their_own_share_one_row():
    names = ["coulomb", "stribeck", "friction_drift"]
    found = answer_of("not_identifiable", *(row(name, 0.3) for name in names), set_90=names,
                      next_experiment=None)
    rows = alternatives_section(found).tables[0].rows
    assert [pair for pair, _ in rows] == ["coulomb or stribeck", "all other pairs"]
    found["set_90"] = ["coulomb", "friction_drift"]
    assert alternatives_section(found).tables[0].rows == (
        ("coulomb or friction drift", "none of the experiments that were simulated"),)
    found["next_experiment"] = {"best": {"experiment": "chirp"}, "menu": [
        {"experiment": "chirp", "expected_set_size": 1.2, "least_distance": 40.0}]}
    assert alternatives_section(found).tables[0].rows == (
        ("coulomb or friction drift", "the experiment recommended below"),)


@pytest.mark.parametrize("confounder, title", [(CONTACT, "an obstacle"),
                                               (POSE, "another torque of the pose")])
def test_what_outside_the_library_would_move_the_robot_alike_is_named(confounder, title):
    likely = row("step_fault", 0.13, rival=confounder)
    found = answer_of("unexplained", row("unknown", 0.87, None), likely, joints="a", value=99.0,
                      set_90=["unknown", "step_fault"])
    assert any(point.startswith(f"step fault or {title}")
               for point in alternatives_section(found).points)
    expected = f"These logs cannot distinguish {title} from step fault at a (13 %)."
    assert headline(found).startswith(expected) and expected in summary_line("t", found)
    likely["probability"] = 0.01
    assert not any(point.startswith("step fault or")
                   and title in point for point in alternatives_section(found).points)
    assert headline(found).startswith("No effect in the library")


def test_every_confounder_has_words():
    assert set(CONFOUNDERS) == set(SEPARATED_BY) == {CONTACT, POSE, UNMARKED}


def test_a_line_is_the_headline_and_the_torque_map():
    found = answer_of("effect", row("coulomb", 0.93))
    assert summary_line("arm", found) == f"arm: {headline(found)}"
    table = {"beside": ["coulomb"], "percent": 31.5}
    assert summary_line("arm", {**found, "repeatable": table}).endswith(
        "unseen data. A torque map over position and velocity, added to coulomb, removes 32 % of "
        "the remaining reducible gap.")
    assert "added to the refitted nominal model, removes" in summary_line(
        "arm", {**found, "repeatable": {**table, "beside": []}})
    assert summary_line("arm", {"error": "no log", "exit_code": 3}) == "arm: not diagnosed"


def test_a_summary_says_all_that_matters_in_eight_lines():
    found = answer_of(
        "effect", row("coulomb", 0.93), set_90=["coulomb", "stribeck"],
        gap_before=2.0, gap_after=4e-3, gap_floor=None, noise=[{"sigma": 1e-6, "unit": "m"}],
        repeatable={"beside": ["coulomb"], "percent": 31.5}, decisions=["a"],
        log_decisions=["a", "b"],
        next_experiment={"best": {"experiment": "chirp"},
                         "separates": [["coulomb"], ["stribeck", "payload"]]})
    found["where"] = {"block": [{"block": "joint", "share": 0.9},
                                {"block": "gear", "share": 0.0}],
                      "joint": [{"name": "slide", "share": 1.0}]}
    found["closed_percent"] |= {"interval": [90.0, 99.0], "judged_on": "held-out logs"}
    assert summary_lines(found) == [
        "The model is missing coulomb at slide (93 %).",
        "Where the gap lies: by block joint 90 %; by joint slide 100 %.",
        "RMS prediction error: 2 m before, 4 mm after, - from sensor noise alone; 96.4 % (90 to "
        "99 %) of the reducible gap removed, on logs that were not fitted.",
        "90 % set: coulomb and stribeck.",
        "A torque map over position and velocity, added to coulomb, removes 32 % of the remaining "
        "reducible gap.",
        "Next experiment: chirp; separates coulomb from stribeck with payload.",
        "2 assumptions made while reading and diagnosing; the report lists them."]
    bare = {**found, "repeatable": None, "next_experiment": None, "decisions": [],
            "log_decisions": [], "verdict": "none"}
    assert len(summary_lines(bare)) == 5
    assert summary_lines(bare)[-1] == "No assumptions were needed."


def test_a_terminal_shows_the_verdict_first_within_its_width():
    found = answer_of("effect", row("coulomb", 0.93, [1, 2]), row("payload", 0.9, [2]))
    shown = terminal_lines("a robot of a long name", found)
    assert " ".join(shown.split()) == summary_line("a robot of a long name", found)
    lines = shown.splitlines()
    assert len(lines) > 1 and max(map(len, lines)) <= 100
    assert lines[0].startswith("a robot of a long name: The model is missing")
    assert all(line.startswith("  ") for line in lines[1:])


def test_a_set_of_robots_is_sorted_by_cause_and_leads_to_its_reports():
    stuck = answer_of("effect", row("coulomb", 0.5, [1], alike=["asymmetric_coulomb"],
                                    together=0.99),
                      row("asymmetric_coulomb", 0.49, [1], alike=["coulomb"], together=0.99))
    answers = {"b": stuck, "lost": {"error": "no <log>", "exit_code": 3},
               "healthy": answer_of("none"), "a & b": stuck}
    page = overview(answers)
    (table,) = page.sections[0].tables
    assert [str(cells[0]) for cells in table.rows] == ["a & b", "b", "healthy", "lost"]
    assert table.rows[0][1:4] == ("coulomb or asymmetric coulomb", "joint 1", "99 %")
    shown = html(page, {})
    assert '<a href="a%20%26%20b.html">a &amp; b</a>' in shown and "no &lt;log&gt;" in shown


def test_a_report_says_what_one_tells_a_colleague():
    gap = {"gap_before": 2e-3, "gap_after": 1e-4, "gap_floor": 9e-5}
    found = answer_of("effect", row("coulomb", 0.95, [1]), joints=("hip", "knee"), **gap)
    found["set_90"] = ["coulomb"]
    found["closed_percent"]["judged_on"] = "held-out logs"
    told = dict(in_short(found))
    assert list(told) == ["Where", "How sure", "What it buys", "What to do next"]
    assert "hip 50 %" in told["Where"] and "coulomb 95 %" in told["How sure"]
    assert "2 mrad before" in told["What it buys"] and "simulator" in told["What to do next"]
    healthy = dict(in_short({**found, "verdict": "none"}))
    assert "Where" not in healthy and "as it is" in healthy["What to do next"]


def test_one_probability_stands_for_names_that_no_log_tells_apart():
    """The verdict says > 99 %, so that the line beside it must not say 90 %."""
    rows = [{"effect": "coulomb", "probability": 0.5, "together": 0.996,
             "alike": ["asymmetric_coulomb"]},
            {"effect": "asymmetric_coulomb", "probability": 0.5, "alike": []}]
    names = ["coulomb", "asymmetric_coulomb"]
    told = _how_sure({"effects": rows, "set_90": names})
    assert told == ("coulomb 50 % and asymmetric coulomb 50 %, together > 99 %: these logs do not "
                    "tell them apart.")
    apart = [{**row, "alike": []} for row in rows]
    assert "at least 90 %" in _how_sure({"effects": apart, "set_90": names})
