"""The scoreboard of real machines as a page, and as lines for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Section, Table
from clie_blocks.analysis.report.render import save_document
from clie_blocks.output import wrapped

TARGETS = {"first": ("cause, or its class, ranked first", 0.85),
           "joint": ("right joint, where the cause is right", 0.95),
           "in_set": ("90 % set holds the cause", 0.90),
           "sizes": ("size within 10 % or within its interval", 0.90)}


def save_page(board: dict[str, Any], folder: Path) -> str:
    """Write ``real.html`` and its Markdown; return the path of the page."""
    return save_document(document(board), folder, "real")[0]


def document(board: dict[str, Any]) -> Document:
    """Arrange a scoreboard as a document."""
    runs = board["runs"]
    first = board["first"]
    mood = BAD if board["false"] else GOOD if first["right"] == first["of"] else UNSURE
    false = f"{board['false']} effects attributed" if board["false"] else "no effect attributed"
    return Document(
        "Real machines", f"The cause is ranked first in {_of(first)} runs; {false} to a machine "
        "that does not have it.", mood,
        (Section("Figures", tables=(Table(("figure", "measured", "sought"), tuple(
            (text, _of(board[key]), f"{target:.0%}")
            for key, (text, target) in TARGETS.items())),)),
         Section("Runs", tables=(Table(
             ("machine", "run", "truth", "answer", "90 % set", "false attribution"),
             tuple(_cells(row) for row in runs), marks=tuple(map(_mark, runs))),)),
         Section("Sizes", tables=(Table(("machine", "run", "parameter", "known", "found"),
                                        tuple(_sizes(runs)), marks=tuple(
             GOOD if one["right"] else BAD for row in runs for one in row["sizes"])),)),
         Section("How the truths are known", points=tuple(
             f"{row['machine']}, {row['run']}: {row['why'].rstrip('.')}. Logs: {row['source']}"
             for row in runs))))


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """The scoreboard for a terminal: a line or two per run, then the shares."""
    width = max(len(_word(row)) for row in board["runs"])
    lines = [wrapped(f"{_word(row):{width}}  {row['machine']}, {row['run']}: {_answer(row)}")
             for row in board["runs"]]
    shares = [f"{text}: {_of(board[key])} (sought {target:.0%})"
              for key, (text, target) in TARGETS.items() if board[key]["of"]]
    return [*lines, "", *shares, f"effects attributed that are not there: {board['false']}"]


def _of(share: dict[str, int]) -> str:
    return f"{share['right']} of {share['of']}"


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (row["machine"], row["run"], _truth(row), _answer(row),
            ", ".join(row.get("set_90", ())), "; ".join(row["false"]))


def _truth(row: dict[str, Any]) -> str:
    if not row["truth"]:
        return f"no {' or '.join(row['absent'])}" if row["absent"] else "-"
    at = f" at {', '.join(row['joint'])}" if row["joint"] else ""
    return f"{' or '.join(row['truth'])}{at}"


def _answer(row: dict[str, Any]) -> str:
    if "error" in row:
        return row["error"]
    if row["verdict"] == "locked":
        return "twist of the gear"
    first = row["answer"][0]
    at = f" at {', '.join(first['joint'])}" if first["joint"] else ""
    return f"{first['effect']}{at} ({first['probability']:.0%})"


def _word(row: dict[str, Any]) -> str:
    """Verdict on an answer in one or two words."""
    if "error" in row:
        return "refused"
    if row["false"]:
        return "false"
    if row["first"] is None:
        return "measured" if row["sizes"] else "none false"
    return "right" if row["first"] else "in the set" if row["in_set"] else "wrong"


def _mark(row: dict[str, Any]) -> str:
    if row["false"] or "error" in row:
        return BAD
    if row["first"] is None:
        return ""
    return GOOD if row["first"] else UNSURE if row["in_set"] else BAD


def _sizes(runs: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for row in runs:
        for one in row["sizes"]:
            low, high = one["truth"]
            found = "not in the answer" if one["value"] is None else (
                f"{one['value']:.4g} ({one['interval'][0]:.4g} to {one['interval'][1]:.4g})")
            rows.append((row["machine"], row["run"], one["parameter"],
                         f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}", found))
    return rows
