"""The formula for what has no name: its terms as a table."""

from __future__ import annotations

from clie_blocks.analysis.gap.report.cause_words import joint_names
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    Units,
    effect_title,
    join_words,
    number,
    with_prefix,
)
from clie_blocks.analysis.report.document import Section, Table


def formula_section(answer: Answer, units: Units) -> Section | None:
    """The terms of the formula; None where there is none."""
    formula = answer.get("formula")
    if formula is None:
        return None
    interval = "" if formula["interval"] is None else (
        f" ({number(formula['interval'][0])} .. {number(formula['interval'][1])})")
    causes = join_words(map(effect_title, formula["beside"])) or "the refitted nominal model"
    text = (f"The terms below, added to {causes}, remove {number(formula['percent'])} %{interval} "
            f"of the remaining reducible gap, down to {with_prefix(formula['gap'], units['q'])}, "
            f"validated on {formula['judged_on']}. They were chosen by what they predict of parts "
            "of the logs that took no part in the choice. They are a model and no accusation: "
            "they name no cause, change no probability, and hold for the places, speeds and loads "
            "of the logs." + ("" if formula["beside"] else " 'clie export' writes them."))
    joints = joint_names(answer)
    table = Table(("joint", f"torque against the motion, motor side [{units['u']}]"),
                  tuple((joints[term["joint"] - 1], term["torque"]) for term in formula["terms"]),
                  "Their sum acts beside that of the corrected model.")
    return Section("A formula for what has no name", (text,), tables=(table,))
