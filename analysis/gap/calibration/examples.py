"""Diagnosed robots whose truth is known: what the numbers of the verdict are learned from."""

import dataclasses
import json
from pathlib import Path

from clie_blocks.analysis.gap.verdict.evidence import Table, from_json

SEVERAL = ("single", "pair", "triple")  # kinds of trial that are known by their effects
VISIBLE = 0.3  # excess of the nominal model below which an effect of a kept robot hides in noise


@dataclasses.dataclass(frozen=True, eq=False)
class Example:
    """A diagnosed robot.

    Parameters
    ----------
    table : Table
        The evidence, without the fits.
    truth : tuple of str
        Its causes, sorted; or ``none``, ``unknown``, ``parametric``.
    group : str
        Where it comes from: a study, or the kept robots.

    """

    table: Table
    truth: tuple
    group: str = ""


def read_examples(path):
    """Return the examples of a folder of kept robots, or of an opened study of blind trials.

    Parameters
    ----------
    path : path-like
        Folder with ``robot-*.json``, or with ``diagnoses.json`` (of all trials, or of some) and
        ``labels.json``; or one file with a list of kept robots.

    """
    path = Path(path)
    if path.is_file():
        kept = json.loads(path.read_text())
    elif (path / "labels.json").is_file():
        kept = _of_study(path)
    else:
        kept = filter(_is_visible, (json.loads(file.read_text())
                                 for file in sorted(path.glob("robot-*.json"))))
    return [Example(from_json(one), tuple(one["truth"]), path.name) for one in kept]


def _is_visible(kept):
    """Whether the effects of a robot show at all: some are drawn far below the noise."""
    return kept["nothing"] > VISIBLE or kept["truth"][0] in ("none", "unknown", "parametric")


def _of_study(folder):
    """Trials of a study but those on which the controller check decided, not the evidence."""
    from clie_blocks.analysis.gap.causes.vocabulary import FOUND_BY_REPLAY

    labels = json.loads((folder / "labels.json").read_text())
    diagnoses = json.loads((folder / "diagnoses.json").read_text())
    for name, told in sorted(diagnoses.items()):
        label = labels[name]
        from_check = told.get("decisions") or {
            row["effect"] for row in told.get("effects", ())} & set(FOUND_BY_REPLAY)
        if "evidence" in told and not from_check:
            yield {**told["evidence"],
                   "truth": sorted(label["labels"]) if label["kind"] in SEVERAL
                   else [label["kind"]]}
