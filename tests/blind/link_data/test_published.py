"""The published study of wrong and missing link data, and the page that tells it."""

import json
from pathlib import Path

from clie_blocks.analysis.blind.protocol.seeds import are_fresh

DOCS = Path(__file__).resolve().parents[3] / "docs"
BOARD = json.loads((DOCS / "blind" / "link_data.json").read_text())
PAGE = (DOCS / "blind_trials.md").read_text()


def test_the_page_states_every_figure():
    assert BOARD["command"].replace(" --seed", "\n--seed") in PAGE and are_fresh([BOARD["seed"]])
    rows = BOARD["rows"]
    assert sum(bool(row["named_falsely"]) for row in rows) == BOARD["named_falsely"]["hits"]
    for title, hidden in (("every link wrong", "links beyond their tolerance"),
                          ("no links stated", "no links stated")):
        arms = [row for row in rows if row["hidden"] == hidden]
        sound, other = ([row for row in arms if bool(row["effects"]) == has]
                        for has in (False, True))
        cells = " | ".join((
            f"{sum(bool(row['named_falsely']) for row in sound)} of {len(sound)}",
            f"{sum(bool(row['named_falsely']) for row in other)} of {len(other)}",
            f"{sum(row['said'] in row['effects'] for row in other)} of {len(other)}"))
        assert f"| {title} | {cells} |" in PAGE
