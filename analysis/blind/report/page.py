"""The scoreboard as one page, with its plots.

``python -m clie_blocks.analysis.blind.report.page FOLDER`` writes the page again from the
``scoreboard.json`` of a folder.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.protocol.seeds import are_fresh, training_sources, were_opened
from clie_blocks.analysis.blind.report.plots import (
    confusion_matrix,
    reductions,
    reliability,
    shares,
)
from clie_blocks.analysis.blind.report.sections import further_sections
from clie_blocks.analysis.blind.report.wording import (
    HEADLINES,
    REACHED_WORDS,
    SHARE,
    SLICES,
    format_number,
    percent,
    rate_cells,
    value_with_interval,
)
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Document,
    Picture,
    Section,
    Table,
)
from clie_blocks.analysis.report.render import save_document
from clie_blocks.output import command_parser, run_main

MOODS = {"yes": GOOD, "not shown": UNSURE, "no": BAD}


def main(argv: list[str] | None = None) -> int:
    """Write the page of a folder again from its scoreboard."""
    parser = command_parser("python -m clie_blocks.analysis.blind.report.page", main.__doc__ or "",
                            output_help="where to (the folder of the scoreboard)")
    parser.add_argument("folder", type=Path, help="holds scoreboard.json")
    options = parser.parse_args(argv)
    text = (options.folder / "scoreboard.json").read_text()
    page = save_page(json.loads(text), Path(options.output or options.folder))
    print(text if options.json else page)
    return 0


def save_page(board: dict[str, Any], folder: Path) -> str:
    """Write ``scoreboard.html``, its Markdown and plots; return the path of the page.

    Parameters
    ----------
    board : dict
        From `score`, with what `clie blind` adds to it.
    folder : pathlib.Path
        Where to.

    """
    return save_document(document(board), folder, "scoreboard")[0]


def document(board: dict[str, Any]) -> Document:
    """Arrange a scoreboard as a document."""
    share = board["top_1"]["rate"]
    mood = UNSURE if share is None else GOOD if share >= 0.9 else UNSURE if share >= 0.7 else BAD
    return Document(
        "Blind trials", f"Single effect named right: {percent(board['top_1'])}.", mood,
        (targets_section(board), _headlines(board), _calibration_and_reduction(board),
         _confusion(board),
         *(_slice(board, key, text) for key, text in SLICES.items() if board[key]),
         *further_sections(board), protocol_section(board), _errors(board)),
        (("trials", str(board["trials"])), ("seeds", ", ".join(map(str, board["seeds"]))),
         ("achieved / achievable gap reduction", format_number(board["shrinkage"]["median"]))))


def targets_section(board: dict[str, Any]) -> Section:
    """Return the section that holds the measured figures against their targets."""
    rows, marks = [], []
    for row in board["targets"]:
        sign = "\u2265" if row["more_is_better"] else "\u2264"
        measured = value_with_interval({"value": row["measured"], "interval": row["interval"]})
        rows.append((row["words"], f"{sign} {row['target']:g}", measured, row["reached"]))
        marks.append(MOODS[row["reached"]])
    return Section("Target and measured", (REACHED_WORDS,), tables=(Table(
        ("figure", "target", "measured (95 %)", "reached"), tuple(rows), marks=tuple(marks)),))


def _headlines(board: dict[str, Any]) -> Section:
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(board["kinds"].items()))
    rows = tuple((text, *rate_cells(board[key])) for key, text in HEADLINES.items()
                 if board.get(key, {}).get("of") and not key.startswith("left_out"))
    return Section("Scoreboard", (
        f"Robots simulated in MuJoCo; labels were sealed until all diagnoses were on disk: {kinds}"
        ". Intervals of shares are Wilson's, the others come from a bootstrap over the trials.",),
        tables=(Table(("figure", *SHARE), rows),))


def _calibration_and_reduction(board: dict[str, Any]) -> Section:
    calibration = board["calibration"]
    rows = (("Brier score of the decisions", value_with_interval(calibration["brier"])),
            ("expected calibration error", value_with_interval(calibration["ece"])),
            ("size of the 90 % set, mean", value_with_interval(board["set_size"])),
            ("achieved over achievable gap reduction, median",
             value_with_interval(board["shrinkage"])),
            ("gap after a right diagnosis, relative to the true model, median",
             value_with_interval(board["against_true_model"])))
    pictures = (
        Picture("reliability", reliability(calibration["reliability"]),
                "Stated against observed share of right decisions, with 95 % intervals; the "
                "number at each point counts its trials."),
        Picture("reductions", reductions(board["shrinkage"]["points"]),
                "Achieved against achievable reduction of the gap on the unseen log."))
    return Section("Calibration and gap reduction",
                   tables=(Table(("figure", "value (95 %)"), rows),), pictures=pictures)


def _confusion(board: dict[str, Any]) -> Section:
    return Section("Confusions", (), pictures=(
        Picture("confusion", confusion_matrix(board["confusion"]),
                "Rows: the truth. Columns: the decision. On the diagonal: right."),))


def _slice(board: dict[str, Any], key: str, text: str) -> Section:
    rows = tuple((name, *rate_cells(share)) for name, share in board[key].items())
    picture = Picture(key, shares(board[key]), f"Single effect named right, by {text}; "
                      "bars are 95 % intervals.")
    return Section(f"By {text}", (), tables=(Table((text, *SHARE), rows),),
                   pictures=(picture,))


def _errors(board: dict[str, Any]) -> Section:
    rows = tuple((row["trial"], row["robot"], " + ".join(row["true"]), row["kind"],
                  format_number(row["ratio"]), row["said"], f"{row['probability']:.2f}",
                  ", ".join(row["set_90"])) for row in board["wrong"])
    return Section("Wrong decisions", (), tables=(
        Table(("trial", "robot", "truth", "kind", "ratio", "decision", "probability", "90 % set"),
              rows),))


def _proof(seeds: Sequence[int]) -> str:
    """What the figures of some seeds prove."""
    if are_fresh(seeds):
        return "No seed of this page made a robot that the method or its calibration has seen."
    if were_opened(seeds):
        return ("The method stood still before these robots were made, and the figures were "
                "published before anybody looked at them. They have been looked at since: what a "
                "later method says of them is no proof.")
    return "These seeds were used while the method was developed: the figures are no proof."


def protocol_section(board: dict[str, Any]) -> Section:
    """Return the section that says how to make the figures again: seeds, and the command."""
    seeds = ", ".join(map(str, board["seeds"]))
    rows = [("this page", "MuJoCo", str(board["trials"]), seeds), *training_sources()]
    proof = _proof(board["seeds"])
    command = f"Made by: {board['command']}" if board.get("command") else ""
    return Section("Protocol", tuple(text for text in (
        proof, "Labels were encrypted before the first diagnosis and opened after the last; "
        "run.log of each seed holds the digests and proves the order.", command) if text),
        tables=(Table(("used for", "engine", "robots", "seeds"), tuple(rows)),))


if __name__ == "__main__":
    run_main(main)
