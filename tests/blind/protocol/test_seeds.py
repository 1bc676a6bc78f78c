"""Reported seeds are none of those that trained."""

from pathlib import Path

from clie_blocks.analysis.blind.protocol import seeds
from clie_blocks.analysis.blind.report.page import save_page
from clie_blocks.analysis.blind.scoring.score import score


def test_what_is_reported_did_not_train_the_calibration(tmp_path, monkeypatch, plain_study):
    facts = {"robots": 60, "seed": 1, "trials": 200, "seeds": [41, 42]}
    monkeypatch.setattr(seeds, "_calibration_facts", lambda: facts)
    monkeypatch.setattr(seeds, "OPENED_SEEDS", (20005,))
    assert seeds.are_fresh([40, 81]) and not seeds.are_fresh([81, 42])
    assert not seeds.are_fresh([81, 75]) and not seeds.are_fresh([81, 3000])
    assert seeds.training_sources()[0][-1].endswith("20005")
    assert [row[1:] for row in seeds.training_sources()[1:]] == [
        ("own_robots", "60", "1"), ("MuJoCo", "200", "41, 42")]
    assert seeds.were_opened([20005]) and not seeds.were_opened([20005, 81])
    assert not seeds.are_fresh([20005])
    for seed, proof in ((81, True), (42, False), (3000, False)):
        board = plain_study.board(score(plain_study.right_answers, plain_study.labels))
        page = Path(save_page(board | {"seeds": [seed]}, tmp_path))
        assert ("the figures are no proof" in page.read_text()) is not proof


def test_the_calibration_names_the_seeds_that_it_learned_from():
    assert {row[1] for row in seeds.training_sources()} <= {"MuJoCo", "own_robots"}
    assert not set(seeds.calibration_seeds()) & set(range(51, 66))
