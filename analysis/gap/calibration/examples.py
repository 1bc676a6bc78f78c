"""Diagnosed robots whose truth is known: what the calibration is learned from."""

import dataclasses
import json
from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import Any

from clie_blocks.analysis.gap.verdict.evidence import Table, from_json

_BY_EFFECTS = ("single", "pair", "triple")  # kinds of trial that are known by their effects
_VISIBLE = 0.3  # excess of the nominal model, below which an effect hides in noise


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
        Where it comes from: a study, or the stored robots.

    """

    table: Table
    truth: tuple[str, ...]
    group: str = ""


def read_examples(path: str | PathLike[str]) -> list[Example]:
    """Return the examples of a folder of stored robots, or of an opened study of blind trials.

    The path is a folder with ``robot-*.json``, or with ``diagnoses.json`` (of all trials, or of
    some) and ``labels.json``; or one file with a list of stored robots.
    """
    path = Path(path)
    stored: Iterable[dict[str, Any]]
    if path.is_file():
        stored = json.loads(path.read_text())
    elif (path / "labels.json").is_file():
        stored = _of_study(path)
    else:
        robots = (json.loads(file.read_text()) for file in sorted(path.glob("robot-*.json")))
        stored = filter(_is_visible, robots)
    return [Example(from_json(one), tuple(one["truth"]), path.name) for one in stored]


def truth_of(label: dict[str, Any]) -> tuple[str, ...]:
    """Causes of a labelled trial, sorted; or ``none``, ``unknown``, ``parametric``."""
    return tuple(sorted(label["labels"])) if label["kind"] in _BY_EFFECTS else (label["kind"],)


def _is_visible(stored: dict[str, Any]) -> bool:
    """Whether the effects of a robot show at all: some are drawn far below the noise."""
    return stored["nothing"] > _VISIBLE or stored["truth"][0] in ("none", "unknown", "parametric")


def _of_study(folder: Path) -> Iterator[dict[str, Any]]:
    """Trials of a study but those on which the controller check decided, not the evidence.

    Of a study of imperfect logs the labels are the damages; its twins know the robots.
    """
    from clie_blocks.analysis.gap.causes.vocabulary import FOUND_BY_REPLAY

    twins = folder / "undamaged" / "labels.json"
    labels = json.loads((twins if twins.is_file() else folder / "labels.json").read_text())
    diagnoses = json.loads((folder / "diagnoses.json").read_text())
    for name, answer in sorted(diagnoses.items()):
        from_check = answer.get("decisions") or {
            row["effect"] for row in answer.get("effects", ())} & set(FOUND_BY_REPLAY)
        if "evidence" in answer and not from_check:
            yield {**answer["evidence"], "truth": list(truth_of(labels[name]))}
