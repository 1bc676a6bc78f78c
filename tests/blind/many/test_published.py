"""The published study of several effects at once, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.many.scoring import figures
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "many.json").read_text())
PAGE = (DOCS / "blind_trials.md").read_text()


def test_the_published_figures_follow_from_the_rows():
    again = json.loads(to_json(figures(BOARD["rows"])))
    assert {key: BOARD[key] for key in again} == again
    assert again["trials"] == 100
    assert len(again["failed"]) == 1 and "One robot has no answer" in PAGE
    seeds = [int(BOARD["command"].split("--seed ")[1])]
    assert are_fresh(seeds) or were_opened(seeds)


def test_the_page_states_the_figures():
    assert f"`{BOARD['command']}`" in PAGE
    for figure in (BOARD["precision"], BOARD["recall"], BOARD["order"], BOARD["something_more"],
                   *BOARD["recall_by_rank"]):
        low, high = figure["interval"]
        assert f"{figure['hits']} of {figure['of']} ({low:.2f} to {high:.2f})" in PAGE
    closed = BOARD["closed"]
    assert "{:.2f} ({:.2f} to {:.2f})".format(closed["median"], *closed["interval"]) in PAGE
