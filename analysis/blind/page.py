"""The scoreboard as one page, with its pictures."""

from clie_blocks.analysis.blind.plots import confusion_matrix, reliability
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

HEADLINES = {
    "top_1": "single effect named right", "top_3": "single effect among the first three",
    "family": "right family", "joint": "right joint, effect found",
    "effect_and_joint": "effect and joint right", "all_decisions": "all but pairs decided right",
    "false_alarm": "false alarm on a healthy robot",
    "false_structure": "effect claimed where only numbers are off",
    "parametric_named": "numbers beyond the datasheet called so",
    "unknown_detected": "effect outside the library called unknown",
    "unknown_called_none": "effect outside the library missed",
    "false_unknown": "known or nothing called unknown",
    "pair_recall": "members of pairs found", "pair_both_in_top_2": "both of a pair lead",
    "pair_top_1_is_one": "leader of a pair is one of the two",
    "set_coverage": "90 % set holds the truth",
    "left_out_unknown": "effect taken out of the library called unknown",
    "left_out_family": "effect taken out of the library taken for its family",
    "left_out_none": "effect taken out of the library missed"}
SLICES = {"by_size": "size (ratio to the noise floor 1.5, 4, 10)", "by_robot": "robot",
          "by_excitation": "excitation of the fitted logs", "by_effect": "effect"}


def save_page(found, folder):
    """Write ``scoreboard.html`` and its Markdown; return the path of the page.

    Parameters
    ----------
    found : dict
        From `score`, with the seed.
    folder : pathlib.Path
        Where to.

    """
    return save_document(document(found), folder, "scoreboard")[0]


def document(found):
    """Arrange a scoreboard as a document.

    Parameters
    ----------
    found : dict
        From `score`, with the seed.

    """
    share = found["top_1"]["rate"]
    mood = UNSURE if share is None else GOOD if share >= 0.9 else UNSURE if share >= 0.7 else BAD
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(found["kinds"].items()))
    return Document(
        "Blind trials",
        f"Named the hidden effect of {percent(found['top_1'])} robots with one effect.", mood,
        (_headlines(found, kinds), _sets(found), _confusion(found),
         *(_slice(found, key, text) for key, text in SLICES.items() if found[key]),
         _wrong(found), *_left_out(found)),
        (("trials", str(found["trials"])), ("seed", str(found["seed"])),
         ("seconds per trial", number(found["seconds"]["median"])),
         ("achieved / achievable shrinkage", number(found["shrinkage"]["median"]))))


def percent(share):
    """A rate as text, with its interval."""
    if not share["of"]:
        return "-"
    low, high = share["interval"]
    return (f"{100 * share['rate']:.0f} % ({share['hits']} of {share['of']}; "
            f"95 %: {100 * low:.0f} to {100 * high:.0f})")


def number(value):
    """A figure as text; a dash where there is none."""
    return "-" if value is None else f"{value:.3g}"


def _headlines(found, kinds):
    rows = tuple((text, percent(found[key])) for key, text in HEADLINES.items()
                 if found.get(key, {}).get("of"))
    return Section("Scoreboard", (
        f"Robots of MuJoCo with labels under seal until all diagnoses were on disk: {kinds}. "
        "Intervals are Wilson's.",), tables=(Table(("figure", "share"), rows),))


def _sets(found):
    c = found["calibration"]
    rows = (("Brier score of the decisions", number(c["brier"])),
            ("expected calibration error", number(c["ece"])),
            ("names in the 90 % set, mean", number(found["set_size"])),
            ("achieved over achievable shrinkage, median", number(found["shrinkage"]["median"])),
            ("the same, mean", number(found["shrinkage"]["mean"])),
            ("seconds per trial, median", number(found["seconds"]["median"])),
            ("seconds per trial, largest", number(found["seconds"]["largest"])))
    picture = Picture("reliability", reliability(c["reliability"]),
                      "Stated against observed share of right decisions, with 95 % intervals.")
    return Section("How honest, how far", tables=(Table(("figure", "value"), rows),),
                   pictures=(picture,))


def _confusion(found):
    return Section("Confusions", (), pictures=(
        Picture("confusion", confusion_matrix(found["confusion"]),
                "Rows: the truth. Columns: the decision. On the diagonal: right."),))


def _slice(found, key, text):
    rows = tuple((name, percent(share)) for name, share in found[key].items())
    return Section(f"By {text}", (), tables=(Table(("", "single effect named right"), rows),))


def _wrong(found):
    rows = tuple((row["trial"], row["robot"], " + ".join(row["true"]), row["kind"],
                  number(row["ratio"]), row["said"], f"{row['probability']:.2f}",
                  ", ".join(row["set_90"])) for row in found["wrong"])
    return Section("Not right", (), tables=(
        Table(("trial", "robot", "truth", "kind", "ratio", "decision", "stated", "90 % set"),
              rows),))


def _left_out(found):
    rows = tuple((row["effect"], number(row["ratio"]), row["said"], f"{row['probability']:.2f}")
                 for row in found.get("left_out", ()))
    if not rows:
        return ()
    return (Section("Each effect taken out of the library", (
        "The right answer is \"unknown\".",), tables=(
            Table(("effect", "ratio", "decision", "stated"), rows),)),)
