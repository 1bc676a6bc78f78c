"""The published lap of recommended runs, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.experiments.scoring import SOUGHT_RIGHT, SOUGHT_RUNS, figures
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "experiments.json").read_text())
PAGE = (DOCS / "blind_trials.md").read_text()


def test_the_published_figures_follow_from_the_rows():
    again = json.loads(to_json(figures(BOARD["rows"])))
    assert {key: BOARD[key] for key in again} == again
    assert BOARD["ambiguous"]["hits"] == len(BOARD["rows"])
    seeds = [int(BOARD["command"].split("--seed ")[1].split()[0])]
    assert are_fresh(seeds) or were_opened(seeds)


def test_the_page_states_the_figures():
    assert f"`{BOARD['command']}`" in PAGE
    for name in ("right_at_once", "ambiguous", "followed", "reached", "right_of_reached", "before",
                 "after", "exceeded"):
        low, high = BOARD[name]["interval"]
        figure = f"{BOARD[name]['hits']} of {BOARD[name]['of']} ({low:.2f} to {high:.2f})"
        assert figure in PAGE


def test_what_is_sought_of_names_is_reached():
    assert BOARD["runs"]["value"] <= SOUGHT_RUNS
    assert BOARD["right_of_reached"]["rate"] >= SOUGHT_RIGHT


def test_the_page_tells_why_robots_had_no_run():
    alone = [row for row in BOARD["rows"] if not row["used"]]
    beside_unknown = sum("unknown" in row["sets"][0] for row in alone)
    assert f"Of the {len(alone)} without a run {beside_unknown} have `unknown`" in PAGE
    assert not any("unknown" in names for row in BOARD["rows"] if row["used"]
                   for names in row["sets"][:len(row["used"])])
