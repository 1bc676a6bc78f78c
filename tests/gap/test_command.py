"""The command: folders of robots, stored results, a later run that continues, errors in words."""

import io
import json

import pytest

from clie_blocks.analysis.gap import batch
from clie_blocks.analysis.gap.command import main
from clie_blocks.output import guarded, progress


@pytest.fixture(scope="module")
def folder(tmp_path_factory, case, write_trial):
    place = tmp_path_factory.mktemp("set")
    write_trial(case("none", seed=3), place / "trial-1")
    return place


@pytest.fixture(scope="module")
def result(folder, tmp_path_factory):
    """Folder of the results of one run."""
    kept = tmp_path_factory.mktemp("kept")
    assert main([str(folder), "-o", str(kept), "--quiet"]) == 0
    return kept


def test_a_result_is_read_back_unless_it_is_broken(folder, result):
    stored = result / "trial-1.json"
    content = json.loads(stored.read_text())
    assert content["verdict"] == "none" and (result / "trial-1.html").is_file()
    stored.write_text(json.dumps({**content, "seconds": -1.0}))
    (again,) = batch.diagnose_all(batch.find_tasks([folder]), folder=result)
    assert again[0] == "trial-1" and again[1]["seconds"] == -1.0 and "made_from" not in again[1]
    stored.write_text("{broken")
    (again,) = batch.diagnose_all(batch.find_tasks([folder]), folder=result)
    assert again[1]["seconds"] > 0.0 and json.loads(stored.read_text())["verdict"] == "none"


def test_data_goes_to_stdout_and_words_to_stderr(folder, result, capsys):
    assert main([str(folder), "-o", str(result), "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["verdict"] == "none"
    sentence, page = captured.err.splitlines()
    assert sentence == "trial-1: The model agrees with the robot down to the sensor noise."
    assert page == f"report: {result / 'trial-1.html'}" and (result / "trial-1.html").is_file()
    assert main([str(folder), "-o", str(result)]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == (f"{sentence}\n", f"{page}\n")


def test_answers_of_several_robots_are_by_name(folder, result, capsys, monkeypatch):
    stored = json.loads((result / "trial-1.json").read_text())
    monkeypatch.setattr(batch, "find_tasks", lambda *_: [
        batch.Task("trial-2", ("b",)), batch.Task("trial-1", ("a",))])
    monkeypatch.setattr(batch, "diagnose_all", lambda *_: iter(
        [("trial-2", {"error": "no log", "exit_code": 3}), ("trial-1", stored)]))
    assert main([str(folder), "-o", str(result), "--json"]) == 3
    captured = capsys.readouterr()
    answers = json.loads(captured.out)
    assert list(answers) == ["trial-1", "trial-2"] and answers["trial-1"]["verdict"] == "none"
    assert json.loads((result / "answers.json").read_text()) == answers
    assert captured.err.endswith("error: no log\n")
    assert "trial-2: not diagnosed" in captured.err


def test_errors_are_words(tmp_path, folder, capsys):
    assert guarded(main, [str(tmp_path / "nothing")]) == 3
    assert "does not exist" in capsys.readouterr().err
    assert guarded(main, [str(tmp_path)]) == 3
    assert "robot.toml" in capsys.readouterr().err
    assert guarded(main, [str(folder), "--effects", "stribek"]) == 2
    assert "stribeck" in capsys.readouterr().err
    assert guarded(main, [str(folder), "--holdout", "log-9"]) == 3
    assert "log-9" in capsys.readouterr().err


def test_progress_is_shown_to_a_terminal_only_and_once(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for stream, shown in ((Terminal(), 1), (io.StringIO(), 0)):
        monkeypatch.setattr("sys.stderr", stream)
        with progress("diagnosing arm"), progress("reading log.csv", 2) as advance:
            advance(2)
        text = stream.getvalue()
        assert ("diagnosing arm" in text) == bool(shown) and "reading" not in text
