"""The published lap of recommended runs, and the page that tells it."""

import json
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.experiments.scoring import SOUGHT_RIGHT, SOUGHT_RUNS, figures
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD, SECOND = LAPS = [json.loads((DOCS / "blind" / name).read_text())
                        for name in ("experiments.json", "experiments_second.json")]
PAGE = (DOCS / "blind_trials.md").read_text()


@pytest.mark.parametrize("board", LAPS)
def test_the_published_figures_follow_from_the_rows(board):
    again = json.loads(to_json(figures(board["rows"])))
    assert {key: board[key] for key in again} == again
    assert board["ambiguous"]["hits"] == len(board["rows"])
    seeds = [int(board["command"].split("--seed ")[1].split()[0])]
    assert are_fresh(seeds) or were_opened(seeds)


@pytest.mark.parametrize("board", LAPS)
def test_the_page_states_the_figures(board):
    assert f"`{board['command']}`" in PAGE
    for name in ("right_at_once", "ambiguous", "followed", "reached", "right_of_reached", "before",
                 "after", "exceeded"):
        low, high = board[name]["interval"]
        figure = f"{board[name]['hits']} of {board[name]['of']} ({low:.2f} to {high:.2f})"
        assert figure in PAGE


def test_the_page_tells_what_each_lap_misses():
    def missed(board):
        return {name for name, is_reached in (
            ("runs", board["runs"]["value"] <= SOUGHT_RUNS),
            ("right", board["right_of_reached"]["rate"] >= SOUGHT_RIGHT),
            ("limits", board["exceeded"]["hits"] == 0)) if not is_reached}

    assert missed(BOARD) == {"limits"} and "The last figure is missed" in PAGE
    assert missed(SECOND) == {"right"} and "The share of right names is missed" in PAGE


def test_the_page_says_how_often_the_laps_together_are_right():
    hits, of = (sum(board["right_of_reached"][key] for board in LAPS) for key in ("hits", "of"))
    assert f"first in {hits} of {of}\nrobots with one name" in PAGE


def test_the_page_tells_why_robots_had_no_run():
    alone = [row for row in BOARD["rows"] if not row["used"]]
    beside_unknown = sum("unknown" in row["sets"][0] for row in alone)
    assert f"Of the {len(alone)} without a run {beside_unknown} have `unknown`" in PAGE
    assert not any("unknown" in names for row in BOARD["rows"] if row["used"]
                   for names in row["sets"][:len(row["used"])])
