"""Which column of a log is which signal of which joint, by the table of names and the user's map.

A signal that two groups of columns claim is ambiguous, and the user is asked.
"""

import dataclasses
import re
import shlex
from collections.abc import Mapping, Sequence

from clie_blocks.analysis.records.aliases import TIME_UNITS
from clie_blocks.analysis.records.model import CHANNELS, MEANINGS, SIGNALS
from clie_blocks.analysis.records.patterns import Group, assign, claims
from clie_blocks.analysis.records.units import split_unit
from clie_blocks.errors import RecordError, nearest

_Groups = Mapping[str | None, Sequence[Group]]


@dataclasses.dataclass(frozen=True)
class Layout:
    """Columns of the signals: one index per joint, and what had to be guessed.

    `units` are those in the header; `implied` are those that the source of the names defines.
    """

    time: int
    columns: dict[str, list[int]]
    units: dict[str, list[str | None]]
    joints: tuple[str, ...]
    decisions: tuple[str, ...]
    mask: int | None = None
    implied: Mapping[str, str] = dataclasses.field(default_factory=dict)

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
    groups = _by_signal(names, user_map)
    for signal in ("time", "q"):
        if not groups.get(signal):
            raise RecordError(_missing(signal, names, source, user_map, groups))
    _refuse_ambiguous(groups, names, source)
    time, q = claims(groups["time"])[0].columns[""], claims(groups["q"])[0]
    tokens = _ordered(q, joints, source)
    chosen, notes = {"q": q}, []
    for signal in SIGNALS:
        if signal != "q" and (signal in groups or signal in user_map):
            group = _whole(groups, signal, source, user_map, tokens)
            if group is None:
                notes.append(_partial(signal, groups[signal], names, tokens))
            else:
                chosen[signal] = group
    notes += _stand_in(chosen, groups)
    columns = {signal: [group.columns[token] for token in tokens]
               for signal, group in chosen.items()} | _channels(names, user_map, source)
    notes = [*notes, *_readings(names, time, columns), *_meanings(chosen),
             *_unused(names, time, columns)]
    return Layout(time, columns, _units(names, time, columns),
                  _joint_names(tokens, joints, notes), tuple(notes),
                  list(names).index("valid") if "valid" in names else None,
                  {signal: group.names.unit for signal, group in chosen.items()
                   if group.names and group.names.unit})


def _by_signal(names: Sequence[str], user_map: Mapping[str, str]) -> _Groups:
    """Groups of columns by signal; positions of motors count only beside those of the joints.

    Without them, or for other joints, they are those of joints with such names.
    """
    headers = [split_unit(name) for name in names]
    groups = assign(headers, user_map)
    of_joints = [set(group.columns) for group in groups.get("q", ())]
    beside = any(set(group.columns) >= tokens for group in groups.get("q_motor", ())
                 for tokens in of_joints)
    if "q_motor" not in groups or "q_motor" in user_map or beside:
        return groups
    return assign(headers, user_map, unused=("q_motor",))


def _checked(user_map: Mapping[str, str] | None, source: str) -> dict[str, str]:
    """The user's map, if it maps signals and gives the clock one column."""
    user_map = dict(user_map or {})
    for name in user_map:
        if name not in (*SIGNALS, *CHANNELS, "time"):
            raise RecordError(f"{source}: --map {name}=... is not a signal; "
                              f"{nearest(name, ('time', *SIGNALS, *CHANNELS))}")
    for name, what in (("time", "clock"), *CHANNELS.items()):
        if "{" in user_map.get(name, ""):
            raise RecordError(f"{source}: --map {name}={user_map[name]} must name one column: "
                              f"there is one {what}")
    return user_map


def _channels(names: Sequence[str], user_map: Mapping[str, str], source: str,
              ) -> dict[str, list[int]]:
    """Column of each channel of the whole robot that is mapped, or has its name."""
    bare, found = [split_unit(name)[0] for name in names], {}
    for channel in CHANNELS:
        wanted = user_map.get(channel, channel)
        at = next((k for k, name in enumerate(bare) if wanted in (name, names[k])), None)
        if at is not None:
            found[channel] = [at]
        elif channel in user_map:
            raise RecordError(f"{source}: no column is called {wanted!r}; correct "
                              f"{as_option(channel, wanted)}: {nearest(wanted, bare)}")
    return found


def _refuse_twins(names: Sequence[str], source: str) -> None:
    seen = set()
    for name in names:
        if name in seen and name:
            raise RecordError(f"{source}: two columns are called {name!r}, and nothing says which "
                              "one counts; rename or drop one")
        seen.add(name)


SHELL_SAFE = re.compile(r"[-@%+=:,./{}\w]+")


def as_option(signal: str, pattern: str) -> str:
    """The option that maps a signal, quoted where a shell would take it apart."""
    text = f"{signal}={pattern}"
    return f"--map {text if SHELL_SAFE.fullmatch(text) else shlex.quote(text)}"


def _refuse_ambiguous(groups: _Groups, names: Sequence[str], source: str) -> None:
    """Refuse signals that several whole groups claim, all of them in one message."""
    q = [set(group.columns) for group in claims(groups["q"])]
    texts = []
    for signal in ("time", *SIGNALS):
        rivals = claims(groups.get(signal, ()))
        if signal not in ("time", "q"):
            rivals = [group for group in rivals if any(set(group.columns) >= one for one in q)]
        if len(rivals) > 1:
            columns = " and ".join(repr(names[next(iter(group.columns.values()))])
                                   for group in rivals)
            options = " or ".join(as_option(signal, group.pattern) for group in rivals)
            texts.append(f"columns {columns} could both be {signal}; choose one: {options}")
    if texts:
        raise RecordError(f"{source}: {'; '.join(texts)}")


def _whole(groups: _Groups, signal: str, source: str, user_map: Mapping[str, str],
           tokens: Sequence[str]) -> Group | None:
    """The one group of a signal that has all joints."""
    whole = claims(group for group in groups.get(signal, ())
                   if set(group.columns) >= set(tokens))
    if whole:
        return whole[0]
    if signal not in user_map:
        return None
    own = groups.get(signal, ())
    if len(own) == 1 and _counts(own[0].columns, tokens):
        return _numbered(own[0], tokens)
    raise RecordError(f"{source}: {user_map[signal]!r} is missing for at least one joint of "
                      f"{', '.join(tokens)}; correct {as_option(signal, user_map[signal])}")


def _counts(columns: Mapping[str, int], tokens: Sequence[str]) -> bool:
    """Whether the user's columns are numbered and as many as the joints."""
    return len(columns) == len(tokens) and all(token.isdigit() for token in columns)


def _numbered(group: Group, tokens: Sequence[str]) -> Group:
    """The user's numbered columns, taken in the order of the joints."""
    order = sorted(group.columns, key=int)
    return dataclasses.replace(group, columns={
        token: group.columns[number] for token, number in zip(tokens, order)})


def _stand_in(chosen: dict[str, Group], groups: _Groups) -> list[str]:
    """Let what a motor was measured to give stand for a command that is not in the log."""
    tau = chosen.get("tau")
    if groups.get("u") or tau is None or tau.names is None or tau.names.side != "motor":
        return []
    chosen["u"] = tau
    return ["The command u is not logged: the measured "
            f"{'current' if tau.names.unit == 'A' else 'torque'} of the motor stands for it, so "
            "that nothing can be said of the drive in between."]


def _meanings(chosen: Mapping[str, Group]) -> list[str]:
    """What the source of the names says of its signals: side of torques, and other remarks."""
    notes = []
    for signal, group in chosen.items():
        if group.names and group.names.side == "joint":
            notes.append(f"{signal} is on the joint side, by the names of its columns.")
        if group.names and group.names.remark:
            notes.append(group.names.remark)
    return notes


def _partial(signal: str, groups: Sequence[Group], names: Sequence[str],
             tokens: Sequence[str]) -> str:
    shown = ", ".join(names[index] for group in groups
                      for index in list(group.columns.values())[:3])
    numbered = next((group.pattern for group in groups if _counts(group.columns, tokens)), None)
    fix = (f"if their numbers follow the joints, map them: {as_option(signal, numbered)}"
           if numbered else f"to use it, log it for every joint, and name its columns as in "
           f"{as_option(signal, signal + '_{joint}')}")
    of = f"for each of the joints {', '.join(tokens)}" if any(tokens) else "for the joint of q"
    return f"Did not take {signal} from {shown}: not there {of}; {fix}."


def _unused(names: Sequence[str], time: int, columns: Mapping[str, Sequence[int]]) -> list[str]:
    used = {time, *(index for group in columns.values() for index in group)}
    left = [name for index, name in enumerate(names) if index not in used and name
            and name != "valid"]
    shown = ", ".join(left[:6]) + (f" and {len(left) - 6} more" if len(left) > 6 else "")
    return [f"Not used: {shown}."] if left else []


def _missing(signal: str, names: Sequence[str], source: str, user_map: Mapping[str, str],
             groups: _Groups) -> str:
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    if signal in user_map:
        return (f"{source}: no column fits {as_option(signal, user_map[signal])}; the log has "
                f"{listed}")
    what = "a clock" if signal == "time" else "measured joint positions"
    return (f"{source}: no column is recognised as {signal}, and without {what} nothing can be "
            f"identified; the log has {listed}; name the column, as in "
            f"{as_option(signal, _example(signal, names, groups))}")


def _example(signal: str, names: Sequence[str], groups: _Groups) -> str:
    """A pattern that columns without a meaning fit, for an example of the option."""
    taken = {index for found in groups.values() for group in found
             for index in group.columns.values()}
    left = [split_unit(name)[0] for index, name in enumerate(names) if name and index not in taken]
    if signal == "time":
        return left[0] if left else "stamp"
    numbered = [re.sub(r"\d+", "{k}", name, count=1) for name in left if re.search(r"\d", name)]
    return (numbered or left or ["actual_pos_{joint}"])[0]


def _ordered(q: Group, joints: Sequence[str], source: str) -> list[str]:
    """Tokens of the joints in the order of the robot, of their numbers, or of the log."""
    tokens = list(q.columns)
    if joints and set(tokens) == set(joints):
        return list(joints)
    if all(token.isdigit() for token in tokens):
        tokens.sort(key=int)
    elif joints and not _are_default(joints) and tokens != [""]:  # one column names no joint
        unknown = [token for token in tokens if token not in joints] or tokens
        raise RecordError(f"{source}: joint {unknown[0]!r} of the log is not one of the robot; "
                          f"{nearest(unknown[0], joints)}")
    if joints and len(tokens) != len(joints):
        listed = ", ".join(tokens) or "a column without a number"
        raise RecordError(f"{source}: the log has {len(tokens)} joints ({listed}), the robot has "
                          f"{len(joints)}; check that this robot.toml belongs to the log")
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


def _units(names: Sequence[str], time: int,
           columns: Mapping[str, Sequence[int]]) -> dict[str, list[str | None]]:
    units = {"time": [_time_unit(names[time])]}
    for signal, indices in columns.items():
        units[signal] = [split_unit(names[index])[1] for index in indices]
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
    return f"Read {signal} ({MEANINGS[signal]}) from {shown}."
