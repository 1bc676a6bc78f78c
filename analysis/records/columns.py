"""Which column of a log is which signal of which joint, by the aliases and the user's map.

Every column goes to the pattern with the most literal characters that fits it, so that
``q_target_0`` is a reference although ``q_{joint}`` fits too.  A signal that two patterns claim is
ambiguous, and the user is asked.
"""

import dataclasses
import re
from collections.abc import Mapping, Sequence

from clie_blocks.analysis.records.aliases import ALIASES, IMPLIED_UNITS, TIME_UNITS
from clie_blocks.analysis.records.model import SIGNALS
from clie_blocks.analysis.records.units import split_unit
from clie_blocks.errors import RecordError, nearest


@dataclasses.dataclass(frozen=True)
class Layout:
    """Columns matches: per signal one column index per joint, and what had to be guessed."""

    time: int
    columns: dict[str, list[int]]
    units: dict[str, list[str | None]]
    joints: tuple[str, ...]
    decisions: tuple[str, ...]
    mask: int | None = None

    def order(self) -> list[int]:
        """Indices to read: the time, then each signal's columns side by side, then the mask."""
        wanted = [self.time, *(index for matches in self.columns.values() for index in matches)]
        return wanted if self.mask is None else [*wanted, self.mask]


def find_columns(names: Sequence[str], source: str, user_map: Mapping[str, str] | None = None,
                 joints: Sequence[str] = ()) -> Layout:
    """Find the signals in the header of a log.

    Parameters
    ----------
    names : sequence of str
        The header.
    source : str
        Beginning of messages.
    user_map : mapping, optional
        The user's map from signal to pattern, such as ``{"q": "actual_pos_{joint}"}``.
    joints : sequence of str, optional
        Joint names of the robot, in its order; they order the columns where the log names joints.

    Raises
    ------
    RecordError
        If time or q is missing, a signal is ambiguous, or joints do not fit.

    """
    _refuse_twins(names, source)
    user_map = _checked(user_map, source)
    matches = _assign([split_unit(name) for name in names], user_map)
    time = _needed(matches, "time", names, source, user_map).columns[""]
    q = _needed(matches, "q", names, source, user_map)
    tokens = _ordered(q, joints, source)
    chosen, notes = {"q": q}, []
    for signal in SIGNALS:
        if signal != "q" and (signal in matches or signal in user_map):
            group = _whole(matches, signal, names, source, user_map, tokens)
            if group is None:
                notes.append(_partial(signal, matches[signal], names, tokens))
            else:
                chosen[signal] = group
    columns = {signal: [group.columns[token] for token in tokens]
               for signal, group in chosen.items()}
    implied = {signal: IMPLIED_UNITS.get(group.pattern) for signal, group in chosen.items()}
    notes = [*notes, *_readings(names, time, columns), *_unused(names, time, columns),
             *(f"{signal} is in {unit}, not a torque, as its name says."
               for signal, unit in implied.items() if unit)]
    return Layout(time, columns, _units(names, time, columns, implied),
                  _joint_names(tokens, joints, notes), tuple(notes),
                  list(names).index("valid") if "valid" in names else None)


def _checked(user_map: Mapping[str, str] | None, source: str) -> dict[str, str]:
    """The user's map, if it maps signals and gives the clock one column."""
    user_map = dict(user_map or {})
    for name in user_map:
        if name not in (*SIGNALS, "time"):
            raise RecordError(f"{source}: --map {name}=... is not a signal; "
                              f"{nearest(name, ('time', *SIGNALS))}")
    if "{" in user_map.get("time", ""):
        raise RecordError(f"{source}: --map time={user_map['time']} must name one column: there "
                          "is one clock")
    return user_map


@dataclasses.dataclass
class _Found:
    """The columns that one pattern of one signal took: joint token to column index."""

    pattern: str
    columns: dict[str, int]


_Groups = dict[str | None, dict[str, _Found]]  # by signal, None for what only looks like one

def _refuse_twins(names: Sequence[str], source: str) -> None:
    seen = set()
    for name in names:
        if name in seen and name:
            raise RecordError(f"{source}: two columns are called {name!r}, and nothing says which "
                              "one counts; rename or drop one")
        seen.add(name)


def _assign(headers: Sequence[tuple[str, str | None]], user_map: Mapping[str, str]) -> _Groups:
    """Give each column to the user's pattern, else to the most literal alias that fits.

    A column that fits letter by letter comes before one that fits in other letters, so that ``T``
    is no clock beside ``t``.
    """
    patterns: list[tuple[str | None, str, bool]] = [
        (signal, pattern, True) for signal, pattern in user_map.items()]
    aliases = [(signal, pattern, False) for signal, group in ALIASES.items()
               if signal not in user_map for pattern in group]
    patterns += sorted(aliases, key=lambda entry: -len(re.sub(r"\{\w+\}", "", entry[1])))
    regexes = [(signal, pattern, _regex(pattern, own)) for signal, pattern, own in patterns]
    matches: _Groups = {}
    left = list(enumerate(headers))
    for flags in (0, re.IGNORECASE):
        compiled = [(signal, pattern, re.compile(text, flags))
                    for signal, pattern, text in regexes]
        taken = [index for index, header in left if _take(matches, index, header, compiled)]
        left = [(index, header) for index, header in left if index not in taken]
    return matches


def _take(matches: _Groups, index: int, header: tuple[str, str | None],
          compiled: Sequence[tuple[str | None, str, re.Pattern[str]]]) -> bool:
    """Put one column where it belongs; whether it belongs anywhere."""
    name, unit = header
    for signal, pattern, regex in compiled:
        match = regex.fullmatch(name) or (unit is not None and regex.fullmatch(f"{name}[{unit}]"))
        if match:
            token = (match.groups() or ("",))[0]
            group = matches.setdefault(signal, {}).setdefault(pattern, _Found(pattern, {}))
            return group.columns.setdefault(token, index) == index
    return False


def _regex(pattern: str, own: bool) -> str:
    joint = r"(.+?)" if own else r"([^\W_].*?)"
    parts = re.split(r"(\{\w+\})", pattern)
    return "".join(r"(\d+)" if part == "{k}" else joint if part == "{joint}" else re.escape(part)
                   for part in parts)


def _needed(matches: _Groups, signal: str, names: Sequence[str], source: str,
            user_map: Mapping[str, str]) -> _Found:
    """The one pattern of a signal that every log must have."""
    groups = list(matches.get(signal, {}).values())
    if not groups:
        raise RecordError(_missing(signal, names, source, user_map))
    return _only(groups, signal, names, source)


def _whole(matches: _Groups, signal: str, names: Sequence[str], source: str,
           user_map: Mapping[str, str], tokens: Sequence[str]) -> _Found | None:
    """The one pattern of a signal that has all joints."""
    groups = list(matches.get(signal, {}).values())
    whole = [group for group in groups if set(group.columns) >= set(tokens)]
    if whole:
        return _only(whole, signal, names, source)
    if signal not in user_map:
        return None
    if len(groups) == 1 and _counts(groups[0].columns, tokens):
        return _numbered(groups[0], tokens)
    raise RecordError(f"{source}: {user_map[signal]!r} is missing for at least one joint of "
                      f"{', '.join(tokens)}; correct --map {signal}=...")


def _only(groups: Sequence[_Found], signal: str, names: Sequence[str], source: str) -> _Found:
    if len(groups) > 1:
        claims = [names[next(iter(group.columns.values()))] for group in groups]
        raise RecordError(f"{source}: columns {' and '.join(map(repr, claims))} could both be "
                          f"{signal}; choose one: --map {signal}={groups[0].pattern}")
    return groups[0]


def _counts(columns: Mapping[str, int], tokens: Sequence[str]) -> bool:
    """Whether the user's columns are numbered and as many as the joints."""
    return len(columns) == len(tokens) and all(token.isdigit() for token in columns)


def _numbered(group: _Found, tokens: Sequence[str]) -> _Found:
    """The user's numbered columns, taken in the order of the joints."""
    order = sorted(group.columns, key=int)
    return _Found(group.pattern, {token: group.columns[number]
                                  for token, number in zip(tokens, order)})


def _partial(signal: str, groups: Mapping[str, _Found], names: Sequence[str],
             tokens: Sequence[str]) -> str:
    shown = ", ".join(names[index] for group in groups.values()
                      for index in list(group.columns.values())[:3])
    return (f"Did not take {signal} from {shown}: not there for each of the joints "
            f"{', '.join(tokens)}; if their numbers follow the joints, map them, as in "
            f"--map {signal}=motor{{k}}.")


def _unused(names: Sequence[str], time: int, columns: Mapping[str, Sequence[int]]) -> list[str]:
    used = {time, *(index for group in columns.values() for index in group)}
    left = [name for index, name in enumerate(names) if index not in used and name
            and name != "valid"]
    shown = ", ".join(left[:6]) + (f" and {len(left) - 6} more" if len(left) > 6 else "")
    return [f"Not used: {shown}."] if left else []


def _missing(signal: str, names: Sequence[str], source: str, user_map: Mapping[str, str]) -> str:
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    if signal in user_map:
        return (f"{source}: no column fits --map {signal}={user_map[signal]}; the log has "
                f"{listed}")
    what = "a clock" if signal == "time" else "measured joint positions"
    example = "time=stamp" if signal == "time" else "q=actual_pos_{joint}"
    return (f"{source}: no column is recognised as {signal}, and without {what} nothing can be "
            f"identified; the log has {listed}; name the column with --map {example}")


def _ordered(q: _Found, joints: Sequence[str], source: str) -> list[str]:
    """Tokens of the joints in the order of the robot, of their numbers, or of the log."""
    tokens = list(q.columns)
    if joints and set(tokens) == set(joints):
        return list(joints)
    if all(token.isdigit() for token in tokens):
        tokens.sort(key=int)
    elif joints and not _are_default(joints):
        unknown = [token for token in tokens if token not in joints] or tokens
        raise RecordError(f"{source}: joint {unknown[0]!r} of the log is not one of the robot; "
                          f"{nearest(unknown[0], joints)}")
    if joints and len(tokens) != len(joints):
        raise RecordError(f"{source}: the log has {len(tokens)} joints ({', '.join(tokens)}), the "
                          f"robot has {len(joints)}; check that this robot.toml belongs to the "
                          "log")
    return tokens


def _are_default(joints: Sequence[str]) -> bool:
    return tuple(joints) == tuple(f"joint{k + 1}" for k in range(len(joints)))


def _joint_names(tokens: Sequence[str], joints: Sequence[str],
                 notes: list[str]) -> tuple[str, ...]:
    if joints and not _are_default(joints):
        return tuple(joints)
    if all(token.isdigit() or token == "" for token in tokens):
        if tokens[0] == "0":
            notes.append("Joints are numbered from 0 in the log; joint 0 became joint1.")
        return tuple(f"joint{k + 1}" for k in range(len(tokens)))
    return tuple(tokens)


def _units(names: Sequence[str], time: int, columns: Mapping[str, Sequence[int]],
           implied: Mapping[str, str | None]) -> dict[str, list[str | None]]:
    units = {"time": [_time_unit(names[time])]}
    for signal, indices in columns.items():
        units[signal] = [split_unit(names[index])[1] or implied.get(signal) for index in indices]
    return units


def _time_unit(name: str) -> str | None:
    base, unit = split_unit(name)
    suffix = base.lower().rsplit("_", 1)[-1]
    return unit or (suffix if suffix in TIME_UNITS else None)


def _plain(signal: str, names: Sequence[str], indices: Sequence[int]) -> bool:
    """Whether the log uses the canonical names, so that nothing was guessed."""
    wanted = {"time"} if signal == "time" else {signal} | {f"{signal}{k + 1}"
                                                           for k in range(len(indices))}
    return {split_unit(names[index])[0] for index in indices} <= wanted


def _readings(names: Sequence[str], time: int, columns: Mapping[str, Sequence[int]]) -> list[str]:
    """What was read from columns with other names than the canonical ones."""
    return [_note(signal, [names[index] for index in indices])
            for signal, indices in (*columns.items(), ("time", [time]))
            if not _plain(signal, names, indices)]


def _note(signal: str, used: Sequence[str]) -> str:
    shown = ", ".join(used[:3]) + (", ..." if len(used) > 3 else "")
    return f"Read {signal} ({SIGNALS.get(signal, 'the clock')}) from {shown}."
