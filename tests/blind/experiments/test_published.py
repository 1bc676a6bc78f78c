"""The published lap of recommended runs, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.experiments.scoring import figures
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
    for name in ("right_at_once", "ambiguous", "followed", "before", "after", "exceeded"):
        low, high = BOARD[name]["interval"]
        figure = f"{BOARD[name]['hits']} of {BOARD[name]['of']} ({low:.2f} to {high:.2f})"
        assert figure in PAGE


def test_the_page_states_the_rows_without_something_unknown():
    """Runs are no longer recommended beside it; what is left of the lap follows from the rows."""
    rows = [row for row in BOARD["rows"] if row["used"] and not any(
        "unknown" in names for names in row["sets"][:len(row["used"])])]
    one_name = sum(row["runs"] == 1 for row in rows)
    right = sum(row["right"][-1] for row in rows)
    largest = max(max(used) for row in rows for used in row["used"])
    for told in (f"{len(rows)} robots, one name after the first run in {one_name}",
                 f"first in {right} of {len(rows)}, at most {largest:.2f} of a limit"):
        assert told in " ".join(PAGE.split())
