"""``clie diagnose``: where a model is wrong, which effect causes it, how far the gap shrinks."""




def summary_line(name, answer):
    """One line for a reader: verdict, joints, probability, and what it buys."""
    from clie_blocks.analysis.gap.report.wording import parameter_deviations
    from clie_blocks.analysis.gap.verdict.posterior import LIKELY

    if "error" in answer:
        return f"{name}: not diagnosed"
    likely = [row for row in answer["effects"] if row["probability"] >= LIKELY]
    causes = [_stated(answer, row) for row in likely if row["effect"] != "unknown"]
    if answer["verdict"] == "not_identifiable":
        causes = [_undecided(answer, LIKELY)]
    if answer["verdict"] == "unexplained":
        causes = [*_confounder(answer), *causes]
    closed, unseen = (answer["closed_percent"][key] for key in ("value", "unseen_data"))
    if answer["verdict"] == "parametric":
        causes = parameter_deviations(answer, _numbered(answer)) or causes
    closes = "the nearest closes" if answer["verdict"] == "unexplained" else "closes"
    bought = "" if closed is None or answer["verdict"] in ("none", "parametric") else (
        f"; {closes} {round(closed)} % of the reducible gap on "
        + ("unseen data" if unseen else "the data that it was fitted to"))
    table = answer.get("repeatable")
    rest = "" if table is None else (
        "; a torque table over place and speed beside "
        f"{' and '.join(table['beside']) or 'the refitted model'} removes "
        f"{table['percent']:.0f} % of what that leaves")
    return (f"{name}: {answer['verdict']}" + (f": {', '.join(causes)}" if causes else "") + bought
            + rest)


def _confounder(answer):
    """Something outside the library that has a name, beside the cause that moves alike."""
    from clie_blocks.analysis.gap.report.wording import FOREIGN, confounded

    return [f"{FOREIGN[row['rival']]} or {_stated(answer, row)}" for row in confounded(answer)[:1]]


def _numbered(answer):
    return [f"joint {k + 1}" for k in range(len(answer.get("noise", ())))]


def _stated(answer, row):
    """An effect with joints and probability, and that of its family where only this is sure."""
    from clie_blocks.analysis.gap.report.wording import family_probability

    family = family_probability(answer, row)
    kind = f"; {family[0]} {family[1]:.0%}" if family else ""
    return f"{row['effect']}{_at_joints(row['joint'])} ({row['probability']:.0%}{kind})"


def _undecided(answer, least):
    """What is left where no name is likely: the family that is, or all names."""
    from clie_blocks.analysis.gap.report.wording import family_of, likely_family

    likely = likely_family(answer, least)
    if likely:
        family, probability, row = likely
        return (f"{family_of(family)} ({probability:.0%}), most likely {row['effect']}"
                f"{_at_joints(row['joint'])} ({row['probability']:.0%})")
    return " or ".join("something unknown" if name == "unknown" else name
                       for name in answer["set_90"])


def _at_joints(joints):
    return "" if not joints else " at joint " + " and ".join(map(str, joints))
