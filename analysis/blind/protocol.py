"""How the trials were made, and what is disjoint from what, for the end of the page."""

from clie_blocks.analysis.blind.seeds import disjoint, taught
from clie_blocks.analysis.report.document import Section, Table


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
