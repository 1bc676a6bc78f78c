"""Which name of the table, or of the user's map, each column of a log fits.

Every column goes to the pattern with the most literal characters that fits it, so that
``q_target_0`` is a reference although ``q_{joint}`` fits too.
"""

import dataclasses
import functools
import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from clie_blocks.analysis.records.aliases import GOAL_WORDS, SOURCES, Names

_GOAL = "|".join(GOAL_WORDS)
PLACEHOLDERS = {
    "{k}": r"(?P<joint>\d+)",
    "{joint}": r"(?P<joint>(?<!^/)[^\W_][^/]*?)",  # a topic comes before the joint
    "{topic}": rf"(?P<path>(?:(?!{_GOAL})\S)*[/.])",
    "{goal}": rf"(?P<path>\S*(?:{_GOAL})\S*[/.])",
}
OWN = {**PLACEHOLDERS, "{joint}": "(?P<joint>.+?)"}  # in the user's map a joint may begin anyhow


@dataclasses.dataclass
class Group:
    """The columns that one pattern took: joint to column index, and what the table says."""

    pattern: str
    columns: dict[str, int]
    names: Names | None = None

    @property
    def second(self) -> bool:
        """Whether it is only taken where nothing else is the signal."""
        return self.names is not None and self.names.second


@dataclasses.dataclass(frozen=True)
class _Pattern:
    """A pattern as written, the signal it gives, and how it is read."""

    signal: str | None
    text: str
    names: Names | None
    places: Mapping[str, str]
    flags: int

    @functools.cached_property
    def regex(self) -> re.Pattern[str]:
        """The expression; only those are compiled that a column comes near."""
        written = "".join(self.places.get(part) or re.escape(part) for part in self._parts)
        return re.compile(written, self.flags)

    @functools.cached_property
    def _parts(self) -> list[str]:
        return re.split(r"(\{\w+\})", self.text)

    @functools.cached_property
    def _literals(self) -> list[str]:
        return [part.casefold() for part in self._parts if part not in self.places]

    @functools.cached_property
    def longest(self) -> str:
        """The most letters in a row that a name must have to fit, in lower case."""
        return max(self._literals, key=len)

    def match(self, name: str, written: str, folded: str) -> re.Match[str] | None:
        """Match of a column's name, alone or as written with its unit."""
        if not all(letters in folded for letters in self._literals):
            return None
        return self.regex.fullmatch(name) or self.regex.fullmatch(written)


def assign(headers: Sequence[tuple[str, str | None]], user_map: Mapping[str, str],
           unused: Collection[str] = ()) -> dict[str | None, list[Group]]:
    """Give each column to the user's pattern, else to the most literal name that fits.

    A column that fits letter by letter comes before one that fits in other letters, so that ``T``
    is no clock beside ``t``.

    Parameters
    ----------
    headers : sequence of (str, str or None)
        Name and unit of each column.
    user_map : mapping
        Signal to pattern.
    unused : collection of str
        Signals whose names in the table do not count.

    Returns
    -------
    dict
        Per signal the groups of columns that claim it; under None what only looks like a signal.

    """
    marks = tuple(source.mark for source in SOURCES
                  if source.mark and any(source.mark in name for name, _ in headers))
    found: dict[tuple[str | None, str], Group] = {}
    left = list(enumerate(headers))
    for flags in (0, re.IGNORECASE):
        patterns = [*(_Pattern(signal, pattern, None, OWN, flags)
                      for signal, pattern in user_map.items()),
                    *(pattern for pattern in _table(marks, flags)
                      if pattern.signal not in user_map and pattern.signal not in unused)]
        left = [(index, header) for index, header in left
                if not _take(found, index, header, patterns)]
    groups: dict[str | None, list[Group]] = {}
    for (signal, _), group in found.items():
        groups.setdefault(signal, []).append(group)
    return groups


def claims(groups: Iterable[Group]) -> list[Group]:
    """Groups that claim a signal: second names only where there is no first."""
    groups = list(groups)
    return [group for group in groups if not group.second] or groups


@functools.cache
def _table(marks: tuple[str, ...], flags: int) -> tuple[_Pattern, ...]:
    """Patterns of the table, those of marked sources first, then the most literal."""
    entries = [(source.mark in marks, names, text) for source in SOURCES
               if not source.mark or source.mark in marks
               for names in source.names for text in names.patterns()]
    entries.sort(key=lambda entry: (not entry[0], -_literal(entry[2])))
    return tuple(_Pattern(names.signal, text, names, PLACEHOLDERS, flags)
                 for _, names, text in entries)


def _literal(pattern: str) -> int:
    """Letters that a pattern fixes; a path has a separator at least, that of a goal a word."""
    least = {"{topic}": "/", "{goal}": "cmd/"}
    return len(re.sub(r"\{\w+\}", lambda place: least.get(place[0], ""), pattern))


def _take(found: dict[tuple[str | None, str], Group], index: int,
          header: tuple[str, str | None], patterns: Iterable[_Pattern]) -> bool:
    """Put one column where it belongs; whether it belongs anywhere."""
    name, unit = header
    written = name if unit is None else f"{name}[{unit}]"
    folded = written.casefold()
    near = (pattern for pattern in patterns if pattern.longest in folded)  # a few of hundreds
    for pattern in near:
        match = pattern.match(name, written, folded)
        if match:
            parts = match.groupdict()
            text = pattern.text
            for place in ("{topic}", "{goal}"):
                text = text.replace(place, parts.get("path") or "")
            group = found.setdefault((pattern.signal, text), Group(text, {}, pattern.names))
            return group.columns.setdefault(parts.get("joint") or "", index) == index
    return False
