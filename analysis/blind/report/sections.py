"""Sections of the page on the studies that `clie blind` adds where it is asked to."""

from clie_blocks.analysis.blind.report.plots import shares
from clie_blocks.analysis.blind.report.wording import (
    FAMILIES,
    HEADLINES,
    OUTCOMES,
    SHARE,
    cells,
    number,
    short,
    with_interval,
)
from clie_blocks.analysis.report.document import Picture, Section, Table


def further(found):
    """Sections of those further studies that a scoreboard holds.

    Parameters
    ----------
    found : dict
        From `score`, with what `clie blind` adds to it.

    """
    return tuple(section(found) for key, section in SECTIONS.items() if found.get(key))


def _left_out(found):
    rows = tuple((row["trial"], row["effect"], number(row["ratio"]), row["said"],
                  f"{row['probability']:.2f}") for row in found["left_out"])
    shares_found = tuple((text, *cells(found[key])) for key, text in HEADLINES.items()
                         if key.startswith("left_out") and found[key]["of"])
    return Section("Each effect taken out of the library", (
        "Trials with one effect, evenly over effects and seeds, diagnosed again by a library that "
        "lacks this effect. The right answer is \"unknown\"; where a cousin "
        "describes the motion just as well, it is named instead.",),
        tables=(Table(("figure", *SHARE), shares_found),
                Table(("trial", "effect taken out", "ratio", "decision", "stated"), rows)))


def _controllers(found):
    family = found["controllers"]
    by_wrong = tuple((name, ", ".join(f"{row[key]['hits']} {key}" for key in OUTCOMES
                                      if row[key]["hits"]))
                     for name, row in family["by_hidden"].items())
    return Section(FAMILIES["controllers"].capitalize(), (
        f"{family['trials']} sound robots of their own draw, whose file says something of the "
        "controller that is not so: the discretisation or a corner of its velocity filter, a "
        "gain, or nothing of a period between measurement and command. Right is what says that it "
        "is a matter of the controller; a diagnosis that accuses the robot would send somebody to "
        "the wrong place.",),
        tables=(_outcomes(family), Table(("described wrong", "outcome"), by_wrong)))


def _spatial(found):
    family = found["spatial"]
    rows = tuple((row["hidden"], f"{row['said']} {row['stated']:.2f}") for row in family["rows"])
    return Section(FAMILIES["spatial"].capitalize(), (
        f"{family['trials']} arms of their own draw: a vertical axis that carries two links. The "
        "robot file has no words for such links, so that their pull is in the logs and in no "
        "model. Every other arm is sound: then \"unknown\" is right, or \"none\" where the pull "
        "hides in the noise. The others have an effect, too, which may be named; \"unknown\" is "
        "an honest answer there as well, another effect is none.",),
        tables=(_outcomes(family), Table(("hidden", "decision, stated"), rows)))


def _outcomes(family):
    return Table(("figure", *SHARE), tuple((text, *cells(family[key]))
                                           for key, text in OUTCOMES.items() if family[key]["hits"]
                                           or key.startswith("accused")))


def _engines(found):
    rows = tuple((f"{row['learned_on']}; {row['tested_on']} ({row['robots']} robots)",
                  with_interval(row["loss"]), short(row["top_1"]), with_interval(row["ece"]))
                 for row in found["engines"])
    return Section("Calibrated on one engine, tested on the other", (
        "Thresholds and probability map learned on the robots of one engine and judged on those "
        "of the other, beside those that were set by hand. The figures rest on the tables of "
        "hypotheses alone, without what the controller check establishes. Loss: mean negative "
        "logarithm of the probability of the truth.",),
        tables=(Table(("learned on; tested on", "loss [nats]", "right first %",
                       "calibration error"), rows),))


def _compared(found):
    rows = found["compared"]
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(rows[0]["kinds"].items()))
    tables = (
        _methods(rows, ("right first %", "among three %", "right joint %"), lambda row: (
            short(row["top_1"]), short(row["top_3"]), short(row["joint"]))),
        _methods(rows, ("both of a pair lead %", "false alarm %", "unknown found %"), lambda row: (
            short(row["pair_all_in_top_2"]), short(row["false_alarm"]),
            short(row["unknown_detected"]))),
        _methods(rows, ("90 % set holds the truth %", "calibration error"), lambda row: (
            short(row["set_coverage"]), with_interval(row["ece"]))),
        _methods(rows, ("gap over true model's", "time [s]"), lambda row: (
            with_interval(row["against_true_model"]), number(row["seconds"]["median"]))))
    picture = Picture("compared", shares({row["method"]: row["top_1"] for row in rows}),
                      "Single effect named right; bars are 95 % intervals.")
    return Section("What each stage buys, and what other methods reach", (
        f"The same {rows[0]['trials']} trials ({kinds}), taken at equal distances from all trials "
        "in the order of kind, size and effect; the same logs, the same knowledge of robot and "
        "controller. A line that begins with \"no\" is the diagnosis less that stage: what it "
        "loses against the diagnosis is what the stage buys. The others are the methods of today, "
        "which cannot say \"unknown\".",
        "First, trial by trial against the diagnosis: how many only it has right (all effects, "
        "where there are several), how many only the other; the difference in percentage points; "
        "how much less probability the other gives to the truth; and by what factor the gap on "
        "the unseen log grows. Where an interval holds 0 (the last column: 1), these trials do "
        "not tell the two apart. Then: how often the cause is found; what happens with two "
        "causes, none, and one that nobody knows; how honest the probabilities are; the gap after "
        "diagnoses that name the effect right, and the median time.",),
        tables=(*_paired(rows[1:]), *tables), pictures=(picture,))


def _paired(rows):
    found = [(row["method"], row["paired"]) for row in rows]
    return (Table(("against it", "only it", "only the other", "lost, points"), tuple(
        (method, str(held["only_first"]), str(held["only_second"]), _points(held["lost"]))
        for method, held in found)),
        Table(("against it", "less for the truth", "gap grows by"), tuple(
            (method, with_interval(held["stated"]), with_interval(held["gap"]))
            for method, held in found)))


def _points(share):
    low, high = share["interval"]
    return f"{100 * share['value']:.0f} ({100 * low:.0f} to {100 * high:.0f})"


def _methods(rows, head, figures):
    return Table(("method", *head), tuple((row["method"], *figures(row)) for row in rows))


SECTIONS = {"left_out": _left_out, "controllers": _controllers, "spatial": _spatial,
            "engines": _engines, "compared": _compared}
