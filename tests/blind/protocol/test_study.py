"""A folder keeps its study, and changed trials are refused."""

import pytest

from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.errors import ClieError


def test_a_folder_keeps_its_study(free_study, tmp_path):
    study.make_trials(tmp_path, 2, 4)
    study.make_trials(tmp_path, 2, 4)
    with pytest.raises(ClieError, match="holds a study of 2 trials with seed 4"):
        study.make_trials(tmp_path, 2, 5)


def test_trials_that_were_changed_after_sealing_are_refused(free_study, tmp_path):
    study.make_trials(tmp_path, 2, 4)
    (tmp_path / study.TRIALS / "trial-001" / "robot.toml").write_text("joints = 2\n")
    with pytest.raises(ClieError, match="changed since they were made"):
        study.diagnose_trials(tmp_path)


def test_a_run_killed_before_its_seal_makes_the_same_study(free_study, tmp_path, monkeypatch):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    study.make_trials(whole, 2, 4)

    def die(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(study.seal, "seal", die)
        with pytest.raises(KeyboardInterrupt):
            study.make_trials(killed, 2, 4)
    (killed / study.TRIALS / "trial-000" / ".log-1.csv.gz.x7q").write_text("half a file")
    study.make_trials(killed, 2, 4)
    made, again = (seal.read_log(folder) for folder in (whole, killed))
    assert [line["event"] for line in again] == ["made", "made", "sealed"]
    assert {line["digest"] for line in again[:2]} == {made[0]["digest"]}
    assert not (killed / study.OPEN).exists()


def test_what_was_answered_is_not_answered_again(free_study, tmp_path):
    study.make_trials(tmp_path, 2, 4)
    first = {"trial-000": {"effects": []}, "trial-001": {"error": "no answer"}}
    assert study.diagnose_trials(tmp_path, diagnose=lambda folder, jobs: first) == first

    def fails(folder, jobs):
        raise AssertionError("diagnosed once more")

    assert study.diagnose_trials(tmp_path, diagnose=fails) == first
    assert [line["event"] for line in seal.read_log(tmp_path)].count("diagnosed") == 1
    file = tmp_path / study.DIAGNOSES
    file.write_text(file.read_text().replace("no answer", "another"))
    with pytest.raises(AssertionError, match="once more"):
        study.diagnose_trials(tmp_path, diagnose=fails)
