"""The verdict in one sentence, and which numbers of the robot file are off."""

from __future__ import annotations

from clie_blocks.analysis.gap.report.cause_words import (
    candidates,
    cause_at_joints,
    confounded,
    joint_names,
    leading_rows,
    listed_causes,
)
from clie_blocks.analysis.gap.report.wording import (
    CONFOUNDERS,
    JOINT_PARAMETERS,
    Answer,
    Row,
    join_words,
    number,
    percent,
)
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    MODEL_DIVERGED,
    NONE,
    NOT_BORNE_OUT,
    PARAMETRIC,
    UNKNOWN,
)

SHOWN_DEVIATIONS = 3  # parameters in a sentence


def verdict_sentence(answer: Answer) -> str:
    """Return the verdict in one sentence: causes, joints, probabilities."""
    verdict = answer["verdict"]
    if verdict == "none":
        return "The model agrees with the robot down to the sensor noise."
    if verdict == "parametric":
        if answer.get("description"):
            return f"The numbers of robot.toml are off: {wrong_numbers(answer)}."
        deviations = parameter_deviations(answer)
        return ("The model structure is right, but parameters are outside their tolerance"
                + (f": {'; '.join(deviations)}." if deviations else "."))
    if verdict == "not_identifiable":
        return f"These logs do not identify the cause: {candidates(answer)}."
    if verdict == "unexplained":
        return _unexplained(answer)
    return f"The model is missing {listed_causes(leading_rows(answer), answer)}."


def wrong_numbers(answer: Answer) -> str:
    """Numbers that are off, in words: 'links.mass_kg of joint 2 is 0.62 kg, stated 0.5'."""
    joints = joint_names(answer)
    alternatives: dict[int, list[str]] = {}
    for row in answer.get("description", ()):
        alternatives.setdefault(row.get("alternative", 1), []).append(
            _wrong_number(row, joints[row["joint"] - 1]))
    said = ", or ".join(join_words(numbers) for numbers in alternatives.values())
    return said + (" (these logs do not tell them apart)" if len(alternatives) > 1 else "")


def _wrong_number(row: Row, joint: str) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    if row["key"] == "zero_rad":
        return (f"where the log of {joint} reads 0, the joint stands at "
                f"{number(row['identified'])}{unit}")
    return (f"{row['key']} of {joint} is {number(row['identified'])}{unit}, stated "
            f"{number(row['stated'])}" + (f" ({row['note']})" if row.get("note") else ""))


def or_the_file(answer: Answer) -> list[str]:
    """Numbers of the robot file that would explain the gap as well; as a list of one or none."""
    rows = answer.get("description", ())
    if not rows or answer["verdict"] == PARAMETRIC:
        return []
    certain = rows[0]["probability"] >= LIKELY
    head = ("The numbers of robot.toml are off as well" if certain
            else f"Or the numbers of robot.toml are off ({percent(rows[0]['probability'])})")
    return [f"{head}: {wrong_numbers(answer)}."]


def _unexplained(answer: Answer) -> str:
    sure = [row for row in answer["effects"]
            if row["probability"] >= LIKELY and row["effect"] not in (NONE, UNKNOWN)]
    if confounded(answer) and not sure:
        row = confounded(answer)[0]
        return (f"These logs cannot distinguish {CONFOUNDERS[row['rival']]} from "
                f"{listed_causes([row], answer)}.")
    law = "" if answer.get("controller_as_stated", True) or answer.get("controller") else (
        ", and the stated control law is not the one that ran")
    if answer.get("reason") == MODEL_DIVERGED:
        return ("The model diverged on these logs, so that no effect can be told: check gains, "
                "units and control law in the robot file.")
    if answer.get("reason") == NOT_BORNE_OUT:
        return f"{_not_borne_out(answer)}{law}."
    if sure:
        return (f"The model is missing {listed_causes(sure, answer)}, and something more that no "
                f"effect in the library explains{law}.")
    return f"No effect in the library explains the gap{law}."


def _not_borne_out(answer: Answer) -> str:
    """Why the closest effect is not named."""
    closest = join_words(cause_at_joints(row, answer) for row in answer["closest"])
    return (f"No effect in the library explains the gap: {closest} would fit these logs best, but "
            "does not predict unseen data clearly better than the refitted nominal model")


def parameter_deviations(answer: Answer) -> list[str]:
    """Joint parameters beyond what the datasheet allows, in words, worst first."""
    deviations, joints = [], joint_names(answer)
    for name, entry in answer.get("joint_model", {}).items():
        rows = zip(joints, *(entry[key] for key in ("value", "stated", "tolerance")))
        deviations += [
            (abs(value - stated) / tolerance,
             f"{JOINT_PARAMETERS.get(name, name)} at {joint} {number(value)} {entry['unit']}, "
             f"stated {number(stated)}")
            for joint, value, stated, tolerance in rows if abs(value - stated) > tolerance > 0.0]
    worst = [text for _, text in sorted(deviations, reverse=True)]
    return worst[:SHOWN_DEVIATIONS] + (
        [f"{len(worst) - SHOWN_DEVIATIONS} more"] if len(worst) > SHOWN_DEVIATIONS else [])
