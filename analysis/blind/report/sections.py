"""Sections of the page on the further studies of `clie blind`, each if it was run."""

from collections.abc import Callable
from typing import Any

from clie_blocks.analysis.blind.report.plots import shares
from clie_blocks.analysis.blind.report.wording import (
    HEADLINES,
    OUTCOMES,
    POPULATIONS,
    SHARE,
    format_number,
    rate_cells,
    short_rate,
    value_with_interval,
)
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Picture,
    Section,
    Table,
)


def further_sections(board: dict[str, Any]) -> tuple[Section, ...]:
    """Sections of those further studies that a scoreboard holds."""
    return tuple(section(board) for key, section in SECTIONS.items() if board.get(key))


def _by_name(board: dict[str, Any]) -> Section:
    rows, marks = [], []
    for name, row in board["by_name"].items():
        share = row["right"]
        rows.append((name, row["class"], row["kind"], f"{share['hits']}/{share['of']}",
                     f"{row['set_size']:.1f}", ", ".join(
                         f"{said} {count}" for said, count in row["wrong"].items())))
        marks.append(GOOD if share["hits"] == share["of"] else
                     BAD if share["hits"] < share["of"] / 2 else UNSURE)
    return Section("Every name", (
        "Names that no log tells apart are one class, and any of them is right where another is "
        "true. The right answer is the class of an effect, \"parametric\" for a parameter of the "
        "datasheet and \"unknown\" for what the catalogue does not hold.",), tables=(Table(
            ("name", "class", "kind", "right", "mean set", "wrong answers"), tuple(rows),
            marks=tuple(marks)),))


def _left_out(board: dict[str, Any]) -> Section:
    rows = tuple((row["trial"], row["effect"], format_number(row["ratio"]), row["said"],
                  f"{row['probability']:.2f}") for row in board["left_out"])
    rates = tuple((text, *rate_cells(board[key])) for key, text in HEADLINES.items()
                  if key.startswith("left_out") and board[key]["of"])
    return Section("Each effect removed from the library", (
        "Trials with one effect, evenly over effects and seeds, diagnosed again by a library "
        "without this effect. The right answer is \"unknown\"; if another effect explains the "
        "motion just as well, that one is named instead.",),
        tables=(Table(("figure", *SHARE), rates),
                Table(("trial", "effect removed", "ratio", "decision", "probability"), rows)))


def _controllers(board: dict[str, Any]) -> Section:
    population = board["controllers"]
    by_wrong = tuple((name, ", ".join(f"{row[key]['hits']} {key}" for key in OUTCOMES
                                      if row[key]["hits"]))
                     for name, row in population["by_hidden"].items())
    return Section(POPULATIONS["controllers"].capitalize(), (
        f"{population['trials']} healthy robots, drawn separately, whose file describes the "
        "controller wrong: the discretisation or a corner of its velocity filter, a gain, or a "
        "missing period of delay between measurement and command. An answer is right if it "
        "points to the controller; a diagnosis that attributes the gap to the robot would send "
        "somebody to the wrong part.",),
        tables=(_outcome_table(population), Table(("described wrong", "outcome"), by_wrong)))


def _spatial(board: dict[str, Any]) -> Section:
    population = board["spatial"]
    rows = tuple((row["hidden"], f"{row['said']} {row['stated']:.2f}")
                 for row in population["rows"])
    return Section(POPULATIONS["spatial"].capitalize(), (
        f"{population['trials']} arms, drawn separately: a vertical axis that carries two links. "
        "The robot file cannot describe such links, so their coupling is in the logs and in no "
        "model. Every other arm is healthy: then \"unknown\" is right, or \"none\" where the "
        "coupling is below the noise. The others also have an effect, which may be named; "
        "\"unknown\" is a valid answer there as well, another effect is not.",),
        tables=(_outcome_table(population), Table(("hidden", "decision, probability"), rows)))


def _outcome_table(population: dict[str, Any]) -> Table:
    return Table(("figure", *SHARE), tuple(
        (text, *rate_cells(population[key])) for key, text in OUTCOMES.items()
        if population[key]["hits"] or key.startswith("accused")))


def _engines(board: dict[str, Any]) -> Section:
    rows = tuple((f"{row['learned_on']}; {row['tested_on']} ({row['robots']} robots)",
                  value_with_interval(row["loss"]), short_rate(row["top_1"]),
                  value_with_interval(row["ece"])) for row in board["engines"])
    return Section("Calibrated on one engine, tested on the other", (
        "Thresholds and probability map learned on the robots of one engine and tested on those "
        "of the other, compared with those that were set by hand. The figures use only the tables "
        "of hypotheses, without what the controller check establishes. Loss: mean negative "
        "logarithm of the probability of the truth.",),
        tables=(Table(("learned on; tested on", "loss [nats]", "ranked first %",
                       "calibration error"), rows),))


def _comparison(board: dict[str, Any]) -> Section:
    rows = board["compared"]
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(rows[0]["kinds"].items()))
    tables = (
        _method_table(rows, ("ranked first %", "among three %", "right joint %"), lambda row: (
            short_rate(row["top_1"]), short_rate(row["top_3"]), short_rate(row["joint"]))),
        _method_table(
            rows, ("both of a pair first %", "false alarm %", "unknown found %"), lambda row: (
                short_rate(row["pair_all_in_top_2"]), short_rate(row["false_alarm"]),
                short_rate(row["unknown_detected"]))),
        _method_table(rows, ("90 % set contains the truth %", "calibration error"), lambda row: (
            short_rate(row["set_coverage"]), value_with_interval(row["ece"]))),
        _method_table(rows, ("gap relative to the true model",), lambda row: (
            value_with_interval(row["against_true_model"]),)))
    picture = Picture("compared", shares({row["method"]: row["top_1"] for row in rows}),
                      "Single effect named right; bars are 95 % intervals.")
    return Section("What each stage contributes, and what other methods reach", (
        f"The same {rows[0]['trials']} trials ({kinds}), taken at equal distances from all trials "
        "in the order of kind, size and effect; the same logs, the same knowledge of robot and "
        "controller. A line that begins with \"no\" is the diagnosis without that stage: what it "
        "loses against the diagnosis is the contribution of the stage. The others are the methods "
        "in use today, which cannot answer \"unknown\".",
        "First, trial by trial against the diagnosis: how many only the diagnosis has right (all "
        "effects, where there are several), how many only the other method; the difference in "
        "percentage points; how much less probability the other gives to the truth; and by what "
        "factor the gap on the unseen log grows. Where an interval contains 0 (last column: 1), "
        "these trials do not distinguish the two. Then: how often the cause is found; what "
        "happens with two causes, none, and one outside the library; how well the probabilities "
        "are calibrated; the gap after right diagnoses.",),
        tables=(*_paired_tables(rows[1:]), *tables), pictures=(picture,))


def _paired_tables(rows: list[dict[str, Any]]) -> tuple[Table, Table]:
    paired = [(row["method"], row["paired"]) for row in rows]
    return (Table(("against it", "only diagnosis", "only the other", "lost, points"), tuple(
        (method, str(held["only_first"]), str(held["only_second"]), _points(held["lost"]))
        for method, held in paired)),
        Table(("against it", "less for the truth", "gap grows by"), tuple(
            (method, value_with_interval(held["stated"]), value_with_interval(held["gap"]))
            for method, held in paired)))


def _points(share: dict[str, Any]) -> str:
    low, high = share["interval"]
    return f"{100 * share['value']:.0f} ({100 * low:.0f} to {100 * high:.0f})"


def _method_table(rows: list[dict[str, Any]], head: tuple[str, ...],
                  figures: Callable[[dict[str, Any]], tuple[str, ...]]) -> Table:
    return Table(("method", *head), tuple((row["method"], *figures(row)) for row in rows))


SECTIONS: dict[str, Callable[[dict[str, Any]], Section]] = {
    "by_name": _by_name,
    "left_out": _left_out, "controllers": _controllers, "spatial": _spatial,
    "engines": _engines, "compared": _comparison}
