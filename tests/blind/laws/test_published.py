"""The published study of laws, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.laws.drawn import KINDS
from clie_blocks.analysis.blind.laws.scoring import ACCUSED, LOST, NAMED
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.analysis.blind.scoring.intervals import rate, share_difference
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "laws.json").read_text())
PAGE = " ".join((DOCS / "laws.md").read_text().split())
ROWS = BOARD["rows"]
SOUND = [row for row in ROWS if row["effect"] == "none"]
OTHERS = [row for row in ROWS if row["effect"] != "none"]


def again(figure):
    return json.loads(to_json(figure))


def test_the_published_figures_follow_from_the_rows():
    assert again(rate(row["law_named"] for row in ROWS)) == BOARD["law_named"]
    assert again(rate(row["accused"] for row in SOUND)) == BOARD["accused"]
    assert again(rate(row["answer"] == "none" for row in SOUND)) == BOARD["none_of_sound"]
    assert again(rate(row["right"] for row in OTHERS)) == BOARD["right_first"]
    assert again(rate(row["accused"] for row in OTHERS)) == BOARD["wrong_of_effects"]
    beside = again(share_difference([(row["right"], row["twin_right"]) for row in OTHERS]))
    assert beside["value"] == BOARD["beside_twins"]["value"]
    assert {row["law"] for row in ROWS} == set(KINDS)


def test_its_seed_was_not_developed_on():
    seeds = [int(BOARD["command"].split("--seed ")[1])]
    assert are_fresh(seeds) or were_opened(seeds)  # looked at, but after the study


def test_the_page_states_every_figure():
    assert f"`{BOARD['command']}`" in PAGE
    figures = [BOARD[key] for key in ("law_named", "accused", "none_of_sound", "right_first",
                                      "right_first_of_twins", "wrong_of_effects")]
    for figure in [*figures, *BOARD["by_description"].values()]:
        low, high = figure["interval"]
        assert f"| {figure['hits']} of {figure['of']} ({low:.2f} to {high:.2f}) |" in PAGE
    low, high = (100.0 * bound for bound in BOARD["beside_twins"]["interval"])
    assert f"{100.0 * BOARD['beside_twins']['value']:+.0f} ({low:+.0f} to {high:+.0f})" in PAGE
    assert BOARD["law_named"]["rate"] >= NAMED


def test_the_page_counts_what_is_answered_otherwise():
    assert [row["answer"] for row in OTHERS if not row["right"]] == ["failed"]
    assert not [row for row in SOUND if row["answer"] != "none"]
    assert [row["effect"] for row in OTHERS if row["accused"]] == ["backlash"] * 2
    assert BOARD["accused"]["rate"] <= ACCUSED and BOARD["beside_twins"]["value"] >= LOST
