"""Every key of a robot file with its kind, bounds and meaning, read from the fields themselves.

The page of the documentation, the JSON Schema for editors, and the check of a file are made from
the same table, so that none of them can forget a key.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator
from typing import Any

from clie_blocks.analysis.records.controller_section import PROGRAM
from clie_blocks.analysis.records.fields import OWN_LAW
from clie_blocks.analysis.records.model import DEFAULT_UNITS, MEANINGS
from clie_blocks.analysis.records.robot_file import SECTIONS
from clie_blocks.analysis.records.robot_sections import Experiment

SCHEMA = "robot.schema.json"
TABLES = {
    "units": "Unit of a signal of the logs, where it is not the one given below.",
    "columns": "Name of the columns of a signal, with `{joint}` for the name of a joint or `{k}` "
               "for its number, where they are not recognised."}
TOP = {
    "name": "What the robot is.",
    "joints": "Number of joints; the one key that every file needs.",
    "joint_names": "Names of the joints, in the order in which all lists count them."}
KINDS = {
    "joints": "number, or one per joint", "number": "number", "vector": "three numbers",
    "matrix": "list of rows", "lists": "list per joint", "positions": "number by name",
    "numbers": "number, or list of numbers, by name",
    "names": "list of names", "text": "text", "flag": "true or false"}
_NUMBER = {"type": "number"}
_SCHEMAS: dict[str, dict[str, Any]] = {
    "vector": {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3},
    "matrix": {"type": "array", "items": {"type": "array", "items": _NUMBER}},
    "lists": {"type": "array"},
    "positions": {"type": "object", "additionalProperties": _NUMBER},
    "numbers": {"type": "object", "additionalProperties": {
        "anyOf": [_NUMBER, {"type": "array", "items": _NUMBER, "minItems": 1}]}},
    "names": {"type": "array", "items": {"type": "string"}},
    "text": {"type": "string"}, "flag": {"type": "boolean"}}


@dataclasses.dataclass(frozen=True)
class Key:
    """One key of a section of the robot file.

    Parameters
    ----------
    section, name : str
        Where it stands, and what it is called.
    kind : str
        Of its value, see `file_field`.
    choices : tuple of str
        The values of a choice.
    above, least : float or None
        Bounds of its numbers: greater than, at least.
    meaning : str
        What it says, with its unit.

    """

    section: str
    name: str
    kind: str
    choices: tuple[str, ...]
    above: float | None
    least: float | None
    meaning: str

    @property
    def value(self) -> str:
        """What may be written, in words."""
        if self.kind == "table":
            names = ", ".join(f"`{name}`" for name in self.choices)
            return f"table of {names}, each a number, or one per joint"
        if self.choices:
            listed = ", ".join(f'`"{choice}"`' for choice in self.choices)
            return listed + (', `"FILE.py:NAME"`, `"FILE.c:NAME"`' if self.kind == "law" else "")
        if self.above is not None:
            return f"{KINDS[self.kind]}, above {self.above:g}"
        if self.least is not None:
            return f"{KINDS[self.kind]}, at least {self.least:g}"
        return KINDS[self.kind]

    @property
    def schema(self) -> dict[str, Any]:
        """What may be written, as JSON Schema."""
        described = {"description": self.meaning}
        number = _NUMBER | ({} if self.above is None else {"exclusiveMinimum": self.above}) | (
            {} if self.least is None else {"minimum": self.least})
        if self.kind == "law":
            return described | {"anyOf": [{"enum": list(self.choices)},
                                          {"type": "string", "pattern": f"^{OWN_LAW}$"}]}
        per_joint = {"anyOf": [number, {"type": "array", "items": number, "minItems": 1}]}
        if self.kind == "table":
            return described | {"type": "object", "additionalProperties": False,
                                "properties": dict.fromkeys(self.choices, per_joint)}
        if self.choices:
            return described | {"enum": list(self.choices)}
        if self.kind == "joints":
            return described | per_joint
        return described | (number if self.kind == "number" else _SCHEMAS[self.kind])


def keys_of(section: str) -> list[Key]:
    """Return the keys of a section, in the order of its fields."""
    kind = Experiment if section == "experiment" else SECTIONS[section]
    meanings = dict(_documented(kind))
    return [Key(section, name, rules["kind"],
                tuple(choice for choice in rules["choices"] if choice != PROGRAM),
                rules["above"], rules["least"], meanings[field.name])
            for field in dataclasses.fields(kind) if (rules := field.metadata)
            for name in rules["keys"]]


def _documented(kind: type) -> Iterator[tuple[str, str]]:
    """Names of parameters and what their docstring says of them."""
    section = inspect.cleandoc(kind.__doc__ or "").partition("Parameters\n----------\n")[2]
    for head, text in re.findall(r"^(\S[^\n]*)\n((?:    [^\n]*(?:\n|$))+)", section, re.M):
        for name in head.partition(" : ")[0].split(", "):
            yield name, " ".join(text.split())


def robot_schema() -> dict[str, Any]:
    """Return the JSON Schema of a robot file, for editors that complete and check TOML."""
    top: dict[str, dict[str, Any]] = {
        "name": {"type": "string"},
        "joints": {"type": "integer", "minimum": 1, "maximum": 1000},
        "joint_names": {"type": "array", "items": {"type": "string"}, "uniqueItems": True}}
    properties = {name: schema | {"description": TOP[name]} for name, schema in top.items()}
    properties |= {section: _table(section) for section in SECTIONS}
    properties["experiment"] = {
        "type": "object", "additionalProperties": _table("experiment"),
        "description": "How a log was taken, by the stem of its file name."}
    for name, text in TABLES.items():
        properties[name] = {
            "type": "object", "description": text, "additionalProperties": False,
            "properties": {signal: {"type": "string", "description": MEANINGS[signal]}
                           for signal in DEFAULT_UNITS}}
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": "robot.toml",
            "type": "object", "required": ["joints"], "additionalProperties": False,
            "properties": properties}


def _table(section: str) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": False,
            "properties": {key.name: key.schema for key in keys_of(section)}}
