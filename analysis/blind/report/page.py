"""The scoreboard as one page, with its pictures."""

from clie_blocks.analysis.blind.protocol.seeds import disjoint, taught
from clie_blocks.analysis.blind.report.plots import (
    confusion_matrix,
    reductions,
    reliability,
    shares,
)
from clie_blocks.analysis.blind.report.sections import further
from clie_blocks.analysis.blind.report.wording import (
    HEADLINES,
    REACHED_WORDS,
    SHARE,
    SLICES,
    cells,
    number,
    percent,
    with_interval,
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

MOODS = {"yes": GOOD, "not shown": UNSURE, "no": BAD}


def save_page(found, folder):
    """Write ``scoreboard.html`` and its Markdown; return the path of the page.

    Parameters
    ----------
    found : dict
        From `score`, with what `clie blind` adds to it.
    folder : pathlib.Path
        Where to.

    """
    return save_document(document(found), folder, "scoreboard")[0]


def document(found):
    """Arrange a scoreboard as a document.

    Parameters
    ----------
    found : dict
        From `score`, with what `clie blind` adds to it.

    """
    share = found["top_1"]["rate"]
    mood = UNSURE if share is None else GOOD if share >= 0.9 else UNSURE if share >= 0.7 else BAD
    return Document(
        "Blind trials",
        f"Named the hidden effect of {percent(found['top_1'])} robots with one effect.", mood,
        (_targets(found), _headlines(found), _honest(found), _confusion(found),
         *(_slice(found, key, text) for key, text in SLICES.items() if found[key]),
         *further(found), protocol(found), _wrong(found)),
        (("trials", str(found["trials"])), ("seeds", ", ".join(map(str, found["seeds"]))),
         ("seconds per trial", number(found["seconds"]["median"])),
         ("achieved / achievable shrinkage", number(found["shrinkage"]["median"]))))


def _targets(found):
    rows, marks = [], []
    for row in found["targets"]:
        sign = "\u2265" if row["more_is_better"] else "\u2264"
        measured = with_interval({"value": row["measured"], "interval": row["interval"]})
        rows.append((row["words"], f"{sign} {row['target']:g}", measured, row["reached"]))
        marks.append(MOODS[row["reached"]])
    return Section("Target and measured", (REACHED_WORDS,), tables=(Table(
        ("figure", "target", "measured (95 %)", "reached"), tuple(rows), marks=tuple(marks)),))


def _headlines(found):
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(found["kinds"].items()))
    rows = tuple((text, *cells(found[key])) for key, text in HEADLINES.items()
                 if found.get(key, {}).get("of") and not key.startswith("left_out"))
    return Section("Scoreboard", (
        f"Robots of MuJoCo with labels under seal until all diagnoses were on disk: {kinds}. "
        "Intervals of shares are Wilson's, the others are drawn from the trials themselves.",),
        tables=(Table(("figure", *SHARE), rows),))


def _honest(found):
    c = found["calibration"]
    rows = (("Brier score of the decisions", with_interval(c["brier"])),
            ("expected calibration error", with_interval(c["ece"])),
            ("names in the 90 % set, mean", with_interval(found["set_size"])),
            ("achieved over achievable shrinkage, median", with_interval(found["shrinkage"])),
            ("gap after a right diagnosis over the true model's, median",
             with_interval(found["against_true_model"])),
            ("seconds per trial, median", with_interval(found["seconds"])),
            ("seconds per trial, largest", number(found["seconds"]["largest"])))
    pictures = (
        Picture("reliability", reliability(c["reliability"]),
                "Stated against observed share of right decisions, with 95 % intervals; beside "
                "each point the number of trials."),
        Picture("reductions", reductions(found["shrinkage"]["points"]),
                "How far the gap on the unseen log shrinks, against how far it can shrink."))
    return Section("How honest, how far", tables=(Table(("figure", "value (95 %)"), rows),),
                   pictures=pictures)


def _confusion(found):
    return Section("Confusions", (), pictures=(
        Picture("confusion", confusion_matrix(found["confusion"]),
                "Rows: the truth. Columns: the decision. On the diagonal: right."),))


def _slice(found, key, text):
    rows = tuple((name, *cells(share)) for name, share in found[key].items())
    picture = Picture(key, shares(found[key]), f"Single effect named right, by {text}; "
                      "bars are 95 % intervals.")
    return Section(f"By {text}", (), tables=(Table((text, *SHARE), rows),),
                   pictures=(picture,))


def _wrong(found):
    rows = tuple((row["trial"], row["robot"], " + ".join(row["true"]), row["kind"],
                  number(row["ratio"]), row["said"], f"{row['probability']:.2f}",
                  ", ".join(row["set_90"])) for row in found["wrong"])
    return Section("Not right", (), tables=(
        Table(("trial", "robot", "truth", "kind", "ratio", "decision", "stated", "90 % set"),
              rows),))


def protocol(found):
    """Return the section that says how to make the figures again.

    Parameters
    ----------
    found : dict
        The scoreboard, with its seeds and its command.

    """
    seeds = ", ".join(map(str, found["seeds"]))
    rows = [("this page", "MuJoCo", str(found["trials"]), seeds), *taught()]
    said = ("No seed of this page made a robot that the method or its calibration has seen."
            if disjoint(found["seeds"]) else
            "These seeds were used while the method was developed: the figures are no proof.")
    command = f"Made by: {found['command']}" if found.get("command") else ""
    return Section("Protocol", tuple(text for text in (
        said, "Labels were encrypted before the first diagnosis and opened after the last; "
        "run.log of each seed holds the digests and proves the order.", command) if text),
        tables=(Table(("used for", "engine", "robots", "seeds"), tuple(rows)),))
