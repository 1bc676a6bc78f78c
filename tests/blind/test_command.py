"""A study from making to scoreboard."""

import json
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.command import main, terminal_lines
from clie_blocks.analysis.blind.comparison import methods, rerun
from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS
from clie_blocks.analysis.blind.comparison.baselines import BASELINES
from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.analysis.blind.report.page import save_page
from clie_blocks.analysis.blind.scoring.score import score


def test_the_log_proves_the_order(free_study, tmp_path, capsys):
    assert main(["--trials", "3", "--seed", "4", "-o", str(tmp_path), "--json"]) == 0
    board = json.loads(capsys.readouterr().out)
    assert board["false_alarm"] == {"rate": 0.0, "hits": 0, "of": 3,
                                    "interval": [0.0, pytest.approx(0.5615, abs=1e-3)]}
    events = [line["event"] for line in seal.read_log(tmp_path)]
    assert events == ["made", "sealed", "diagnosed", "unsealed"]
    assert not (tmp_path / study.OPEN).exists()
    assert {"scoreboard.html", "scoreboard.json", "labels.json", "diagnoses.json",
            "labels.sealed", "run.log"} <= {path.name for path in tmp_path.iterdir()}


def test_equal_trials_give_equal_pages_whatever_they_cost(free_study, tmp_path, monkeypatch):
    _, answer = free_study
    pages = []
    for seconds in (1.0, 7.0):
        answer["seconds"] = seconds
        folder = tmp_path / str(seconds)
        main(["--trials", "3", "--seed", "4", "-o", str(folder)])
        pages.append({name: (folder / f"scoreboard.{name}").read_text()
                      for name in ("json", "md", "html")})
    assert pages[0] == pages[1]
    assert json.loads((folder / "timings.json").read_text())["seconds"]["median"] == 7.0


def test_several_seeds_make_one_study(free_study, tmp_path, capsys):
    command = ["--trials", "2", "--seed", "4", "5", "-o", str(tmp_path)]
    assert main([*command[:3], "4", "-o", str(tmp_path / "seed-4")]) == 0
    assert main(command) == 0
    board = json.loads((tmp_path / "scoreboard.json").read_text())
    assert board["trials"] == 4 and board["seeds"] == [4, 5]
    assert board["command"] == "clie blind --trials 2 --seed 4 5"
    assert sorted(seal.unseal(tmp_path / "seed-5")) == ["trial-000", "trial-001"]


def test_methods_are_compared_on_the_same_trials(free_study, tmp_path, monkeypatch):
    _, answer = free_study
    monkeypatch.setattr(rerun, "_answer", lambda method, path: answer | {"seconds": 0.5})
    monkeypatch.setattr(rerun, "_answer_in_parallel",
                        lambda tasks, jobs: map(rerun.answer_task, tasks))
    main(["--trials", "3", "--seed", "4", "--baselines", "--ablations", "--subset", "2",
          "-o", str(tmp_path)])
    rows = json.loads((tmp_path / "scoreboard.json").read_text())["compared"]
    assert [row["method"] for row in rows] == [methods.FULL, *BASELINES, *ABLATIONS]
    assert all(row["false_alarm"]["of"] == row["trials"] == 2 for row in rows)
    seconds = json.loads((tmp_path / "timings.json").read_text())["methods"]
    assert [held["median"] for held in seconds.values()] == [1.0] + [0.5] * 8
    assert "seconds" not in (tmp_path / "scoreboard.json").read_text()
    assert [row["paired"]["lost"]["value"] for row in rows[1:]] == [0.0] * 8
    kept = tmp_path / rerun.PARTS / "no-polish"
    assert [path.name for path in sorted(kept.iterdir())] == ["trial-000.json", "trial-002.json"]
    assert "other methods reach" in (tmp_path / "scoreboard.html").read_text()


def test_the_whole_catalogue_is_made_by_laps_and_scored_by_name(free_study, tmp_path):
    from clie_blocks.analysis.blind.population.catalogue import LAP

    main(["--catalogue", "1", "--seed", "4", "-o", str(tmp_path)])
    board = json.loads((tmp_path / "scoreboard.json").read_text())
    assert board["trials"] == LAP
    assert board["command"] == "clie blind --catalogue 1 --seed 4"
    assert board["by_name"]["none"]["right"]["hits"] == LAP
    assert {row["key"] for row in board["targets"]} <= {"false_alarm", "set_coverage",
                                                        "set_size", "ece"}
    assert "Every name" in (tmp_path / "scoreboard.html").read_text()


def test_arms_in_space_are_a_study_of_their_own(free_study, tmp_path):
    main(["--arms", "2", "--seed", "4", "-o", str(tmp_path)])
    board = json.loads((tmp_path / "scoreboard.json").read_text())
    assert board["trials"] == 2 and board["command"] == "clie blind --arms 2 --seed 4"
    assert {row["key"]: row["target"] for row in board["targets"]}["set_coverage"] == 0.95


def test_misdescribed_robots_are_sealed_and_reported(free_study, tmp_path, monkeypatch, capsys):
    command = ["--trials", "2", "--seed", "4", "--controllers", "3", "--spatial", "2",
               "-o", str(tmp_path)]
    label, _ = free_study
    label |= {"wrong": "stated x 1.1", "present": []}
    assert main(command) == 0
    board = json.loads((tmp_path / "scoreboard.json").read_text())
    assert board["command"] == "clie blind --trials 2 --seed 4 --controllers 3 --spatial 2"
    assert board["controllers"]["trials"] == 3 and board["spatial"]["missed"]["hits"] == 2
    text = "wrong description of the controller, false attribution to the robot"
    assert text in capsys.readouterr().out
    for population in ("controllers", "spatial"):
        events = [line["event"] for line in seal.read_log(tmp_path / population)]
        assert events == ["made", "sealed", "diagnosed", "unsealed"]


@pytest.mark.slow
def test_a_small_study_holds_its_accuracy(tmp_path):
    """Twelve fixed trials; tolerances are what may be lost before somebody looks."""
    main(["--trials", "12", "--seed", "20", "--jobs", "2", "-o", str(tmp_path)])
    board = json.loads((tmp_path / "scoreboard.json").read_text())
    assert board["failed"] == []
    assert board["all_decisions"]["rate"] >= 0.7
    assert board["false_alarm"]["of"] == 1 and board["false_alarm"]["rate"] == 0.0
    assert board["unknown_called_none"]["rate"] == 0.0
    assert board["set_coverage"]["rate"] >= 0.7
    assert board["against_true_model"]["median"] <= 1.1


def test_page_and_terminal_show_the_headline(tmp_path, plain_study):
    board = plain_study.board(score(plain_study.right_answers, plain_study.labels))
    text = Path(save_page(board, tmp_path)).read_text()
    assert "single effect named right" in text and "<svg" in text and "1 of 1" in text
    assert "Target and measured" in text and len(text) < 2_000_000
    assert any("single effect named right" in line for line in terminal_lines(board))
