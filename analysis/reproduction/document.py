"""The reproduction as a document: what is open, each comparison with its verdict, the errata."""

from collections import Counter
from collections.abc import Iterable, Sequence

from clie_blocks import paper
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Document,
    Picture,
    Section,
    Table,
)
from clie_blocks.analysis.reproduction import items as items_of
from clie_blocks.analysis.reproduction.errata import errata_section
from clie_blocks.analysis.reproduction.items import Item
from clie_blocks.analysis.reproduction.plots import figure_3, figure_4, figure_6
from clie_blocks.analysis.reproduction.runs import (
    READINGS,
    excitation_levels,
    identification,
    tracking,
)
from clie_blocks.signals import signal

UNSPECIFIED = (
    "the set-point q_d of the identification (pi/3, pi/4 here)",
    "the link inertias J_1, J_2 (zero here: Tables 2 and 3 agree with that best)",
    "how the approximate real values of Table 2 were obtained",
    "where the velocity filter G1 acts: in the robot's loop, in both, or in the input error only",
    "how long the identification ran: 100 s in the text, 55 s in Fig. 3, while Gamma = 20 needs "
    "more than 300 s",
    "sample time and seeds of the noise",
    "whether the mean squared errors include the start, and their sampling",
)
MARKS = {items_of.REPRODUCED: GOOD, items_of.UNSTATED: UNSURE, items_of.ERRATUM: BAD,
         items_of.MISSED: BAD, items_of.PICTURE: ""}
PLACES = {"Bounds and constants": ("section 5.1", "(18)", "Theorem 2", "Theorem 4", "(31)",
                                   "(46)"),
          "Table 3: validation": ("Table 3",)}


def document(items: Sequence[Item], seeds: Sequence[int]) -> Document:
    """Items, figures and errata as a document, ready to be written."""
    counts = Counter(item.verdict for item in items)
    facts = tuple((verdict, str(counts[verdict])) for verdict in MARKS)
    verdict = (f"Of {len(items) - counts[items_of.PICTURE]} comparisons "
               f"{counts[items_of.REPRODUCED]} agree as printed and {counts[items_of.UNSTATED]} "
               f"under a reading that the paper does not state; {_never(items)}.")
    bounds, validation = (Section(title, tables=(_table(items, places),))
                          for title, places in PLACES.items())
    return Document("The paper's results, reproduced", verdict, UNSURE, (
        Section("What the paper does not specify",
                (f"Seeds of the noise: {len(seeds)}, averaged; a verdict follows from the "
                 "difference alone, and nothing was tuned but the one reading that says so.",
                 "The paper does not give:"), UNSPECIFIED),
        bounds, _table_2(items), validation, _figures(items), errata_section()), facts)


def headline(items: Sequence[Item]) -> list[str]:
    """What agrees with the paper, what only in part and what does not, a sentence each."""
    said = ((items_of.REPRODUCED, "Agree as printed"),
            (items_of.UNSTATED, "Agree only under a reading that the paper does not state"),
            (items_of.ERRATUM, "Contradict the paper's own definitions"),
            (items_of.MISSED, "Not reproduced"))
    found = {verdict: [item for item in items if item.verdict == verdict] for verdict, _ in said}
    return [f"{words} ({len(found[verdict])}): "
            f"{', '.join(dict.fromkeys(map(_in_short, found[verdict])))}."
            for verdict, words in said if found[verdict]]


def _in_short(item: Item) -> str:
    """What an item is, without joint and case where these do not matter."""
    name = item.name.split(",")[0].split(" at ")[0]
    return f"{item.place} {name}" if item.place.startswith("Table") else f"{name} of {item.place}"


def _never(items: Sequence[Item]) -> str:
    """Which rows of Table 2 follow under no reading, in words."""
    reached = {item.name for item in items if item.place == "Table 2"
               and item.verdict in (items_of.REPRODUCED, items_of.UNSTATED)}
    missed = [f"CASE {case}" for case in paper.THETA_HAT if f"CASE {case}" not in reached]
    return (f"no reading that was tried gives {' or '.join(missed)} of Table 2"
            if missed else "every row of Table 2 follows under some reading")


def _table(items: Sequence[Item], places: tuple[str, ...]) -> Table:
    chosen = [item for item in items if item.place in places]
    rows = tuple((f"{item.place}: {item.name}", item.reading, join_numbers(item.printed),
                  join_numbers(item.ours) + spread_of(item),
                  join_numbers(item.difference, signed=True), item.verdict) for item in chosen)
    return Table(("item", "reading", "printed", "ours", "difference", "verdict"), rows,
                 marks=tuple(MARKS[item.verdict] for item in chosen))


def _table_2(items: Sequence[Item]) -> Section:
    """Table 2 as the paper lays it out: one column per parameter, one table per case."""
    tables = []
    for case, printed in paper.THETA_HAT.items():
        chosen = [item for item in items
                  if (item.place, item.name) == ("Table 2", f"CASE {case}")]
        rows = [("printed", *_row(printed), "", "")]
        rows += [(item.reading + spread_of(item), *_row(item.ours),
                  f"{max(map(abs, item.difference)):.1e}", item.verdict) for item in chosen]
        tables.append(Table(("reading", *paper.THETA_NAMES, "largest difference", "verdict"),
                            tuple(rows), f"CASE {case}",
                            ("", *(MARKS[item.verdict] for item in chosen))))
    return Section("Table 2: estimates, mean of the last 20 s", (
        "A row counts as reproduced if all six estimates are within 4e-4 of the printed ones.",),
        tables=tuple(tables))


def _row(values: Iterable[float]) -> list[str]:
    return [f"{value:.4f}" for value in values]


def _figures(items: Sequence[Item]) -> Section:
    runs = {}
    for case in (1, 2, 3):
        run = identification(READINGS[0], case)
        runs[case] = run.time, signal(run, "theta_hat")
    levels = [item for item in items if item.place == "Fig. 3"]
    rows = tuple((item.name.rsplit(", ", 1)[1], *(f"{value:.4g}" for value in map(abs, item.ours)))
                 for item in levels)
    table = Table(("window", "(49)", "smallest eigenvalue of (28)", "(49) without excitation",
                   "smallest eigenvalue without"), rows)
    return Section("Figs. 3, 4 and 6", (
        "Fig. 3 prints no values. Its integral (49) is positive without any excitation too, "
        "while the matrix condition (28) then fails: (49) does not imply (28).",), (), (table,), (
        Picture("figure_3", figure_3(excitation_levels(), excitation_levels(0.0)),
                "Weighted excitation (49), as in Fig. 3, and the smallest eigenvalue of (28)."),
        Picture("figure_4", figure_4(runs),
                "Estimates of the three cases as in Fig. 4, Gamma = 20, exact velocities: they "
                "coincide, and have not arrived after 100 s."),
        Picture("figure_6", figure_6(*tracking(1)),
                "Tracking with the estimates of CASE 1 as in Fig. 6; the error is that of the "
                "start.")))


def join_numbers(values: Sequence[float], signed: bool = False) -> str:
    """Values with commas, or a dash where there are none."""
    return ", ".join(f"{value:+.2g}" if signed else f"{value:.5g}" for value in values) or "-"


def spread_of(item: Item) -> str:
    """Standard deviation over the seeds in words, where there are several."""
    return f" (sd up to {max(item.spread):.1g})" if item.spread else ""
