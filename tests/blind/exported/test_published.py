"""The published study of exported corrections, and the page that tells it."""

import json
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.exported.study import score
from clie_blocks.analysis.blind.population.one_joint import NAMES
from clie_blocks.analysis.blind.protocol.seeds import are_fresh
from clie_blocks.output import to_json

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "exported.json").read_text())
SHOWN = {row["effect"] for row in BOARD["trials"]}
PAGE = (DOCS / "export.md").read_text()


def test_the_published_figures_follow_from_the_rows():
    again = json.loads(to_json(score(BOARD["trials"])))
    for key in ("ratio", "package_ratio", "coverage"):
        for name, value in again[key].items():
            assert value == pytest.approx(BOARD[key][name], rel=1e-9)
    assert (again["right"], again["refused"]) == (BOARD["right"], BOARD["refused"])
    assert are_fresh([BOARD["seed"]])
    assert SHOWN <= set(NAMES)


def test_the_page_shows_every_effect_of_the_study():
    for name in SHOWN:
        rows = [row for row in BOARD["trials"] if row["effect"] == name]
        cells = [", ".join(_told(row, key) for row in rows) for key in ("ratio", "coverage")]
        assert f"| {name} | {cells[0]} | {cells[1]} |" in PAGE


def _told(row, key):
    """A figure of a trial as the page has it."""
    value = row.get(key)
    return "-" if value is None else f"{value:.2f}" if key == "ratio" else f"{value:.3f}"


def test_the_page_states_the_figures_as_a_whole():
    page = " ".join(PAGE.split())
    assert f"`{BOARD['command']}`" in page
    assert f"{BOARD['right']} of {len(BOARD['trials'])} were diagnosed right" in page
    ratio, package, band = (BOARD[key] for key in ("ratio", "package_ratio", "coverage"))
    assert "{:.3f} times (median; {:.3f} to {:.3f}), at most {:.2f} times".format(
        ratio["median"], *ratio["interval"], ratio["largest"]) in page
    assert f"the package's own model leaves {package['median']:.3f} times" in page
    assert "{:.3f} (mean of {} robots; {:.3f} to {:.3f})".format(
        band["value"], band["of"], *band["interval"]) in page
