"""Where the gap lies, what the corrected model removes of it, and what would tell more."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from clie_blocks.analysis.gap.report.cause_words import leading_rows
from clie_blocks.analysis.gap.report.wording import (
    CLOSED_LOOP,
    RECORDED_COMMAND,
    WITH_OBSERVER,
    Answer,
    Row,
    effect_title,
    join_words,
    number,
    percent,
    with_prefix,
)
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    NONE,
    PARAMETRIC,
)

VALIDATED_ON = {"held-out logs": "on logs that were not fitted",
                "blocks left out of the fit": "by cross-validation"}
JUDGED_BY = {RECORDED_COMMAND: ", with the recorded command",
             WITH_OBSERVER: ", with an observer, as no known controller holds the machine"}
SHOWN_BLOCKS = 3
SMALL_SHARE = 0.01  # of the gap: blocks and joints below are left out


def reductions(answer: Answer) -> list[str]:
    """What the corrected model removes, where a cause was added; as a list of one or none."""
    closed = answer["closed_percent"]
    if closed["value"] is None or answer["verdict"] in (NONE, PARAMETRIC):
        return []
    data = "unseen data" if closed["unseen_data"] else "the data used for the fit"
    share = f"{abs(closed['value']):.0f} %"
    if closed["value"] < 0.0:
        return [f"{_correction(answer)} enlarges the reducible gap by {share} on {data}."]
    return [f"{_correction(answer)} removes {share} of the reducible gap on {data}."]


def _correction(answer: Answer) -> str:
    """What is added to the model, as the subject of a sentence."""
    if answer["verdict"] == "not_identifiable":
        return "Adding the most likely cause"
    if answer["verdict"] == "unexplained" and not _names_its_model(answer):
        return ("Adding the closest effect" if answer.get("controller_as_stated", True)
                else "Replacing the control law by the one that ran")
    return "Adding it" if len(leading_rows(answer)) == 1 else "Adding them"


def _names_its_model(answer: Answer) -> bool:
    """Whether the causes of the corrected model are named, though something more is there."""
    closest = {row["effect"] for row in answer.get("closest", ())}
    return bool(closest) and closest <= {row["effect"] for row in leading_rows(answer)
                                         if row["probability"] >= LIKELY}


def gap_places(answer: Answer) -> list[str]:
    """Shares by cause, by block and by joint, largest first; as a list of one or none."""
    text = "; ".join(f"by {kind} {shares}" for kind, shares in gap_shares(answer).items()
                     if shares)
    return [f"Where the gap lies: {text}."] if text else []


def gap_shares(answer: Answer) -> dict[str, str]:
    """Shares by cause, block and joint in words, largest first; empty where there is none."""
    where = answer.get("where", {})
    return {"cause": _shares((row["share"]["mean"], _title_of_share(row))
                             for row in answer["effects"] if row.get("share")),
            "block": _shares((row["share"], row["block"]) for row in where.get("block", ())),
            "joint": _shares((row["share"], row["name"]) for row in where.get("joint", ()))}


def _title_of_share(row: Row) -> str:
    """Title of a cause, with the simpler one that takes most of its share."""
    title, share = effect_title(row["effect"]), row["share"]
    if share.get("simpler") and share["as_simpler"] > 0.5 * share["last"] > 0.0:
        return f"{title} (most of it as {effect_title(share['simpler'])})"
    return title


def _shares(pairs: Iterable[tuple[float, str]]) -> str:
    ranked = sorted(pairs, key=lambda pair: -pair[0])[:SHOWN_BLOCKS]
    return ", ".join(f"{name} {percent(share)}" for share, name in ranked if share > SMALL_SHARE)


def how_far(answer: Answer) -> str:
    """Prediction error before and after, its floor, and the share that is removed."""
    noise: Sequence[Row] = answer.get("noise", ())
    unit = noise[0]["unit"] if noise else "rad"
    before, after, floor = (with_prefix(answer[key], unit)
                            for key in ("gap_before", "gap_after", "gap_floor"))
    closed = answer["closed_percent"]
    removed = "no reducible gap"
    if closed["value"] is not None:
        interval = closed["interval"]
        span = f" ({number(interval[0])} to {number(interval[1])} %)" if interval else ""
        removed = f"{number(closed['value'])} %{span} of the reducible gap removed"
    data = VALIDATED_ON.get(closed["judged_on"], "on the fitted log itself")
    data += JUDGED_BY.get(closed.get("judged_by", CLOSED_LOOP), "")
    is_moved_by_noise = closed.get("only_noise") and answer["gap_after"] > answer["gap_before"]
    wanders = (" What is left is noise: it moves this robot further than one that the loop holds "
               "tightly." if is_moved_by_noise else "")
    return (f"RMS prediction error: {before} before, {after} after, {floor} from sensor noise "
            f"alone; {removed}, {data}.{wanders}")


def torque_map_sentence(answer: Answer) -> list[str]:
    """What a torque map removes beyond the causes; as a list of one or none."""
    table = answer.get("repeatable")
    if table is None:
        return []
    causes = join_words(map(effect_title, table["beside"])) or "the refitted nominal model"
    return [f"A torque map over position and velocity, added to {causes}, removes "
            f"{table['percent']:.0f} % of the remaining reducible gap."]


def formula_sentence(answer: Answer) -> list[str]:
    """What a formula without a name removes beyond the causes; as a list of one or none."""
    formula = answer.get("formula")
    if formula is None:
        return []
    causes = join_words(map(effect_title, formula["beside"])) or "the refitted nominal model"
    count = len(formula["terms"])
    exported = "" if formula["beside"] else "; 'clie export' writes it"
    return [f"A formula of {count} term{'s' if count > 1 else ''} that names no cause, added to "
            f"{causes}, removes {formula['percent']:.0f} % of the remaining reducible gap on "
            f"unseen data{exported}."]


def next_run(answer: Answer) -> list[str]:
    """The recommended experiment and what it separates; as a list of one or none."""
    experiment = answer.get("next_experiment")
    if not experiment:
        return []
    causes = join_words((" with ".join(map(effect_title, names))
                         for names in experiment["separates"]), "from")
    return [f"Next experiment: {experiment['best']['experiment']}; separates {causes}."]
