"""The published study of poorer logs, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.poor_logs.kinds import CONDITIONS, CONTENTS
from clie_blocks.analysis.blind.poor_logs.scoring import COVERED, WRONG, figures
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "poor_logs.json").read_text())
PAGE = (DOCS / "logs.md").read_text()


def test_the_published_figures_follow_from_the_rows():
    for key, value in json.loads(to_json(figures(BOARD["rows"]))).items():
        assert BOARD[key] == value
    for kind, names in (("content", CONTENTS), ("condition", CONDITIONS)):
        assert set(BOARD[f"by_{kind}"]) == set(names)
        for name, shown in BOARD[f"by_{kind}"].items():
            rows = [row for row in BOARD["rows"] if row[kind] == name]
            assert json.loads(to_json(figures(rows))) == shown
    seeds = [int(BOARD["command"].split("--seed ")[1])]
    assert are_fresh(seeds) or were_opened(seeds)  # looked at, but after the study
    assert BOARD["wrong"]["rate"] <= WRONG and BOARD["covered"]["rate"] >= COVERED


def test_the_page_states_every_figure():
    assert f"`{BOARD['command']}`" in PAGE
    for key in ("wrong", "covered", "right_first", "unknown", "stopped"):
        figure = BOARD[key]
        low, high = figure["interval"]
        assert f"| {figure['hits']} of {figure['of']} ({low:.2f} to {high:.2f}) |" in PAGE
    for name, row in (BOARD["by_content"] | BOARD["by_condition"]).items():
        hits = [row[key]["hits"] for key in ("wrong", "covered", "right_first", "unknown")]
        cells = " | ".join(map(str, [name.replace("_", " "), row["wrong"]["of"], *hits]))
        assert f"| {cells} |" in PAGE
