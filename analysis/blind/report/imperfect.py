"""The page on imperfect logs: targets, a table by damage, and every answer that was wrong.

``python -m clie_blocks.analysis.blind.report.imperfect FOLDER`` writes the page again from the
``imperfect.json`` of a folder.
"""

import json
from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, KINDS
from clie_blocks.analysis.blind.report.page import MOODS, protocol_section, targets_section
from clie_blocks.analysis.blind.report.wording import SHARE, percent, rate_cells
from clie_blocks.analysis.report.document import BAD, GOOD, Document, Section, Table
from clie_blocks.analysis.report.render import save_document
from clie_blocks.output import command_parser, run_main

STEM = "imperfect"
FIGURES = {
    "wrong_name": "wrong name with half the probability or more",
    "wrong_name_on_twins": "the same, undamaged",
    "wrong_family": "wrong name of another family",
    "false_alarm": "false alarm on a robot without an effect",
    "named": "fault of description or log named",
    "named_on_twins": "the same words on the undamaged twins",
    "fault_of_sound": "sound trial stopped or corrected",
    "missed": "effect missed: none with half the probability or more",
    "stopped": "stopped with an error", "broken": "no answer, or a fault of the program",
    "right": "whole truth ranked first", "twin_right": "the same, undamaged"}

COUNTED = ("right", "twin_right", "named", "wrong_name", "stopped")  # columns by damage


def main(argv: list[str] | None = None) -> int:
    """Write the page of a folder again from its figures."""
    parser = command_parser("python -m clie_blocks.analysis.blind.report.imperfect",
                            main.__doc__ or "", output_help="where to (the folder of the figures)")
    parser.add_argument("folder", type=Path, help=f"holds {STEM}.json")
    options = parser.parse_args(argv)
    text = (options.folder / f"{STEM}.json").read_text()
    page = save_page(json.loads(text), Path(options.output or options.folder))
    print(text if options.json else page)
    return 0


def save_page(board: dict[str, Any], folder: Path) -> str:
    """Write ``imperfect.html`` and its Markdown; return the path of the page.

    Parameters
    ----------
    board : dict
        From `scoring.imperfect.score_imperfect`, with seeds and command.
    folder : pathlib.Path
        Where to.

    """
    return save_document(document(board), folder, STEM)[0]


def document(board: dict[str, Any]) -> Document:
    """Arrange the figures of imperfect logs as a document."""
    mood = max((MOODS[row["reached"]] for row in board["targets"]),
               key=(GOOD, "unsure", BAD).index, default=GOOD)
    return Document(
        "Imperfect logs", f"Wrong name with half the probability or more: "
        f"{percent(board['wrong_name'])}.", mood,
        (targets_section(board), _figures(board), _by_damage(board), _wrong(board),
         _unnamed(board), _lost(board), protocol_section(board)),
        (("trials", str(board["trials"])), ("seeds", ", ".join(map(str, board["seeds"])))))


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Figures for a terminal, one line each."""
    width = max(map(len, FIGURES.values()))
    return [f"{board['trials']} trials, seed {', '.join(map(str, board['seeds']))}",
            *(f"  {words:{width}}  {percent(board[key])}" for key, words in FIGURES.items())]


def _figures(board: dict[str, Any]) -> Section:
    return Section("All figures", (
        "Standard robots; the files of two in three were damaged in one way after the robots had "
        "been run. The twin of a trial is the same robot with its files as they were. Intervals "
        "of shares are Wilson's.",),
        points=tuple(f"{kind}: {words}" for kind, words in KINDS.items()),
        tables=(Table(("figure", *SHARE), tuple((words, *rate_cells(board[key]))
                                                for key, words in FIGURES.items())),))


def _by_damage(board: dict[str, Any]) -> Section:
    rows, marks = [], []
    for name, held in board["by_damage"].items():
        what = ("sound", "files as written", "-")
        if name in DAMAGES:
            what = (name, DAMAGES[name].sentence, DAMAGES[name].kind)
        rows.append((*what, str(held["of"]), *(_count(held[key]) for key in COUNTED)))
        bad = (held["wrong_name"]["hits"] or held["broken"]["hits"]
               or held["named"]["hits"] < held["named"]["of"])
        marks.append(BAD if bad else GOOD)
    return Section("By damage", (
        "Right: the whole truth ranked first, and the same on the undamaged twins. Named: in a "
        "correction, a warning, the error, or the finding on the controller.",), tables=(Table((
            "damage", "what", "kind", "trials", "right", "twins right", "named", "wrong name",
            "stopped"), tuple(rows), marks=tuple(marks)),))


def _count(share: dict[str, Any]) -> str:
    return f"{share['hits']}/{share['of']}" if share["of"] else "-"


def _wrong(board: dict[str, Any]) -> Section:
    rows = tuple((row["trial"], row["damage"], row["robot"], " + ".join(row["true"]),
                  ", ".join(f"{name} {probability:.2f}"
                            for name, probability in row["wrong"].items()) or row["said"],
                  row["twin_said"])
                 for row in board["rows"] if row["wrong"] or row["alarm"])
    return Section("Wrong names and false alarms", tables=(Table(
        ("trial", "damage", "robot", "truth", "said", "said of the twin"), rows),))


def _unnamed(board: dict[str, Any]) -> Section:
    rows = tuple((row["trial"], row["damage"], row["robot"], " + ".join(row["true"]), _said(row))
                 for row in board["rows"] if row["named"] is False)
    return Section("Faults not named", tables=(Table(
        ("trial", "damage", "robot", "truth", "said"), rows),))


def _lost(board: dict[str, Any]) -> Section:
    rows = tuple((row["trial"], row["damage"], row["robot"], " + ".join(row["true"]), _said(row))
                 for row in board["rows"]
                 if row["harmless"] and row["twin_right"] and not row["right"])
    return Section("Lost by a harmless damage", tables=(Table(
        ("trial", "damage", "robot", "truth", "said"), rows),))


def _said(row: dict[str, Any]) -> str:
    return row["error"] or f"{row['said']} {row['probability']:.2f}"


if __name__ == "__main__":
    run_main(main)
