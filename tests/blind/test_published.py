"""The study that is published in docs/blind, if this checkout holds one."""

import json
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.protocol.seeds import disjoint
from clie_blocks.analysis.blind.protocol.targets import judged

BOARD = Path(__file__).resolve().parents[2] / "docs" / "blind" / "scoreboard.json"


@pytest.fixture
def board():
    if not BOARD.is_file():
        pytest.skip("no study is published in docs/blind")
    return json.loads(BOARD.read_text())


def test_the_published_seeds_taught_nothing(board):
    assert disjoint(board["seeds"])
    assert board["command"].startswith("clie blind --trials")


def test_the_published_study_is_whole(board):
    assert board["trials"] == sum(board["kinds"].values()) >= 100
    assert len(board["failed"]) <= 0.01 * board["trials"]
    assert board["targets"] == judged(board)


def test_the_readme_shows_the_published_targets(board):
    readme = (BOARD.parents[2] / "README.md").read_text()
    page = (BOARD.parent / "scoreboard.md").read_text()
    rows = [line.strip() for line in page.splitlines()
            if any(line.startswith(f"| {row['words']} ") for row in board["targets"])]
    assert len(rows) >= len(board["targets"])
    assert all(row in readme for row in rows[:len(board["targets"])])
