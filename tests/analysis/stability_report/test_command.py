"""The stability report: verdicts, exit codes, JSON keys, and what the page says."""

import json
from dataclasses import replace

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.report import render
from clie_blocks.analysis.stability_report import command, loop_bounds, plots, quantities
from clie_blocks.analysis.stability_report.document import document, verdict
from clie_blocks.analysis.stability_report.loop_bounds import analyse_bounds
from clie_blocks.analysis.stability_report.quantities import analyse
from clie_blocks.analysis.stability_report.study import paper_study
from clie_blocks.output import guarded

ISSUE_KEYS = ("schema_version", "mu_0", "eta", "k_1", "k_1_printed", "k_2", "k_3", "k_4", "mu_1",
              "mu_2", "condition")


@pytest.fixture(scope="module")
def analysed():
    return analyse(paper_study())


@pytest.fixture
def reused(analysed, monkeypatch):
    """Other gains get their own bounds; the slower parts are those of the paper's gains."""
    monkeypatch.setattr(plots, "SWEEP", np.array([0.3, 3.0]))
    monkeypatch.setattr(quantities, "analyse", lambda study, advance=None: replace(
        analysed, bounds=analysed.bounds if has_the_papers_gains(study)
        else analyse_bounds(study)))


def has_the_papers_gains(study):
    own, papers = study.joints, paper_study().joints
    return np.array_equal([own.kp, own.kd], [papers.kp, papers.kd])


def test_json_has_the_agreed_keys_and_the_papers_numbers(analysed):
    numbers = command.as_dict(paper_study(), analysed)
    assert set(ISSUE_KEYS) <= set(numbers)
    assert numbers["mu_0"] == pytest.approx(0.9637, abs=5e-5)
    assert numbers["eta"] == 0.8768 and numbers["eta_computed"] == pytest.approx(.876945, abs=1e-5)
    assert numbers["k_1"] == pytest.approx(6.189)
    assert numbers["k_1_printed"] == pytest.approx(11.189)
    assert numbers["k_3"] == 1e-4 and numbers["k_2"] == numbers["k_4"] == 5.0
    assert numbers["mu_1"] == pytest.approx(2.70e-5, abs=5e-8)
    assert numbers["mu_2"] == pytest.approx(1.99, abs=5e-3)
    assert numbers["condition"]["holds"] is True
    np.testing.assert_allclose(numbers["condition"]["per_joint"], [1.2378, 1.2471], atol=1e-6)
    assert numbers["simulated"]["pd_radius"] == pytest.approx(0.1468, abs=1e-4)
    assert numbers["convergence"]["time_constant_s"] == pytest.approx(45.4, abs=0.1)
    assert 50 < numbers["convergence"]["best_gamma"] < 80
    assert 30 < numbers["convergence"]["gamma_for_wanted_time"] <= 40
    over_alpha = numbers["convergence"]["over_alpha"]
    assert over_alpha[1e-3] == pytest.approx(over_alpha[0.0], rel=3e-3)


def test_verdict_of_the_papers_gains_is_good(analysed):
    sentence, mood, advice = verdict(paper_study(), analysed)
    assert mood == "good" and advice == () and "1.238" in sentence


@pytest.mark.slow
def test_unsafe_gains_exit_with_1_and_say_what_to_change(reused, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(render, "drawings", lambda document: {})
    monkeypatch.setattr(render, "html", lambda document, drawn: "")
    assert command.main(["--kd", "2", "--json", "-o", str(tmp_path)]) == 1
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["condition"]["holds"] is False and numbers["mu_1"] is None
    assert "raise Kd from 2 above 2.91" in numbers["advice"][0]
    assert "lower Kp from 10 below" in numbers["advice"][0]
    repaired = paper_study().with_gains(kd=2.92)
    assert analyse_bounds(repaired).condition.holds


def test_report_is_written_and_its_verdict_comes_first(reused, tmp_path, capsys):
    assert command.main(["-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.startswith("Stable")
    page = (tmp_path / "stability.html").read_text()
    order = ["Stable: K_bar", "<h2>The condition", "The mu_0 circle", "Bode plots", "<h2>Errata"]
    places = [page.rindex(text) for text in order]
    assert places == sorted(places) and page.count("<svg") == 7
    text = (tmp_path / "stability.md").read_text()
    assert "6.189" in text and "11.189" in text and "0.9637" in text


def test_nominally_safe_gains_that_the_box_breaks_are_unsure(analysed, monkeypatch):
    monkeypatch.setattr(loop_bounds, "identification_errors",  # the verdict needs no runs
                        lambda *arguments, **options: (analysed.bounds.errors, None))
    edge = paper_study().with_gains(kp=22.47, kd=5.0)  # joint 2 holds, its worst case does not
    bounds = analyse_bounds(edge.with_gains(kp=[10.0, 22.4675]))
    sentence, mood, advice = verdict(edge.with_gains(kp=[10.0, 22.4675]),
                                     replace(analysed, bounds=bounds))
    assert mood == "unsure" and "not for all" in sentence
    assert advice[0].startswith("Joint 2") and "all possible parameters" in advice[0]


def test_diverging_simulation_is_reported_not_raised(analysed):
    study = paper_study().with_gains(kp=2e5)
    bounds = analyse_bounds(study)
    assert bounds.errors is None and bounds.measured["e_late"] == np.inf
    report = document(study, replace(analysed, bounds=bounds, excitation=None))
    assert report.mood == "bad"
    assert any("diverged within 400 s" in sentence for section in report.sections
               for sentence in section.sentences)


@pytest.mark.parametrize("arguments, code", [
    (["--kp", "-1"], 2), (["--kp", "1", "2", "3"], 2), (["--gamma", "0"], 2),
    (["--eps-bar", "-1"], 2), (["--theta", "1", "2"], 2),
    (["--theta", "1"], 2), (["--robot", "nowhere.toml"], 3)])
def test_wrong_options_are_refused_in_words(arguments, code, capsys):
    assert guarded(command.main, arguments) == code
    assert capsys.readouterr().err.startswith("error:")


@pytest.mark.slow
@pytest.mark.parametrize("trial", ["trial-000", "trial-004", "trial-008"])
def test_works_from_a_robot_file(shared, trial, tmp_path, capsys):
    path = shared / "blind" / "practice" / trial / "robot.toml"
    assert command.main(["--robot", str(path), "--json", "-o", str(tmp_path)]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["condition"]["holds"] and numbers["worst_case"]["condition"]["holds"]
    assert 0 < numbers["simulated"]["pd_radius"] < numbers["mu_0"]
    assert "Errata" not in (tmp_path / "stability.html").read_text()


@pytest.mark.parametrize("gains, mu_0", list(paper.MU_0.items()))
def test_mu_0_of_the_three_gain_pairs_through_the_study(gains, mu_0):
    from clie_blocks.analysis.theory.bounds import ultimate_bound

    study = paper_study().with_gains(*gains)
    assert ultimate_bound(study.joints, study.eta_norm).mu_0 == pytest.approx(mu_0, abs=5e-5)
