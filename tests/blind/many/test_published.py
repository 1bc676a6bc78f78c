"""The published studies of several effects at once, and the page that tells them."""

import json
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.many.scoring import figures
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARDS = {name: json.loads((DOCS / "blind" / f"{name}.json").read_text())
          for name in ("many", "many_48", "many_20", "many_20_second")}
TRIALS = {"many": 100, "many_48": 48, "many_20": 20, "many_20_second": 20}
PAGE = (DOCS / "blind_trials.md").read_text()


@pytest.mark.parametrize("name", BOARDS)
def test_the_published_figures_follow_from_the_rows(name):
    board = BOARDS[name]
    again = json.loads(to_json(figures(board["rows"])))
    assert {key: board[key] for key in again} == again
    assert again["trials"] == TRIALS[name]
    seeds = [int(board["command"].split("--seed ")[1])]
    assert are_fresh(seeds) or were_opened(seeds)


def test_robots_without_an_answer_are_told():
    assert len(BOARDS["many"]["failed"]) == 1 and "One robot has no answer" in PAGE
    assert not BOARDS["many_48"]["failed"]


@pytest.mark.parametrize("name", BOARDS)
def test_the_page_states_the_figures(name):
    board = BOARDS[name]
    assert f"`{board['command']}`" in PAGE
    for figure in (board["precision"], board["recall"], board["order"], board["something_more"],
                   *board["recall_by_rank"]):
        low, high = figure["interval"]
        assert f"{figure['hits']} of {figure['of']} ({low:.2f} to {high:.2f})" in PAGE
    closed = board["closed"]
    assert "{:.2f} ({:.2f} to {:.2f})".format(closed["median"], *closed["interval"]) in PAGE
