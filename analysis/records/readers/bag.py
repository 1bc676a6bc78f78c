"""ROS 2 bags (sqlite3 or MCAP): joint states, and the command from another topic."""

import array
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.clock import repeated_stamps, segments
from clie_blocks.analysis.records.model import Record, read_only
from clie_blocks.analysis.records.readers import sandbox
from clie_blocks.analysis.records.readers.options import Options, library_errors, need
from clie_blocks.analysis.records.resampling import hold_last
from clie_blocks.errors import RecordError, nearest

STATES = "sensor_msgs/msg/JointState"
COMMANDS = {"sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray",
            "trajectory_msgs/msg/JointTrajectory"}
LATE = 0.1  # s between stamp and arrival worth a note


def read(path: Path, options: Options) -> list[Record]:
    """Return the record of a bag.

    The stamp in the message's header counts, not the time of recording.  A command holds from its
    own time until the next one; commands arrive as torque (``Float64MultiArray``, or effort of a
    ``JointState``) or as goal (position of a ``JointState``, ``JointTrajectory``).

    """
    need("rosbags.highlevel", "reading ROS 2 bags", "ros", "rosbags")
    arrays, info = sandbox.run("bag.load", path, {
        "topic": options.topic, "command_topic": options.command_topic})
    return [_record(arrays, info, str(path))]


def load(path: str, topic: str | None,
         command_topic: str | None) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return joint states and commands of a bag, or a .mcap or .db3 file; runs in the child."""
    from pathlib import Path

    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with library_errors(path, "a ROS 2 bag"), AnyReader(
            [Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        kinds = {connection.topic: connection.msgtype for connection in bag.connections}
        topic = _one(topic, [name for name, kind in kinds.items()
                             if kind == STATES and name != command_topic], path, "topic", kinds)
        arrays, info = _states(bag, topic, path)
        if command_topic is not None:
            _known(command_topic, kinds, path)
            commands, kind = _commands(bag, command_topic, kinds[command_topic], info["names"])
            arrays.update(commands)
            info["command"] = kind
            info["unnamed"] = kinds[command_topic] == "std_msgs/msg/Float64MultiArray"
    return arrays, {**info, "topic": topic, "command_topic": command_topic,
                    "others": sorted(name for name, kind in kinds.items()
                                     if kind in COMMANDS and name != topic)}


def _one(topic: str | None, candidates: Sequence[str], path: str, option: str,
         kinds: Mapping[str, str]) -> str:
    if topic is not None:
        _known(topic, kinds, path)
        return topic
    if len(candidates) != 1:
        what = f"joint states on {', '.join(candidates)}" if candidates else (
            f"no joint states; its topics are {', '.join(kinds) or 'none'}")
        raise RecordError(f"{path} has {what}; choose one: --{option} NAME")
    return candidates[0]


def _known(topic: str, kinds: Mapping[str, str], path: str) -> None:
    if topic not in kinds:
        raise RecordError(f"{path} has no topic {topic!r}; {nearest(topic, kinds)}")


def _messages(bag: Any, topic: str) -> Iterator[tuple[int, Any]]:
    wanted = [connection for connection in bag.connections if connection.topic == topic]
    for connection, arrival, raw in bag.messages(connections=wanted):
        yield arrival, bag.deserialize(raw, connection.msgtype)


def _stamp(message: Any, arrival: int) -> int:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    nanoseconds = stamp.sec * 10**9 + stamp.nanosec if stamp is not None else 0
    return nanoseconds or arrival


def _states(bag: Any, topic: str, path: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Stamps, and position, velocity, effort by joint in the order of the first message."""
    names: list[str] = []
    stamps: list[int] = []
    arrivals: list[int] = []
    skipped = 0
    rows = array.array("d")  # a tenth of the memory of lists
    for arrival, message in _messages(bag, topic):
        names = names or list(message.name)
        if not names or set(message.name) != set(names) or len(message.position) != len(names):
            skipped += 1
            continue
        order = [message.name.index(name) for name in names]
        for part in ("position", "velocity", "effort"):
            rows.extend(_filled(getattr(message, part), order))
        stamps.append(_stamp(message, arrival))
        arrivals.append(arrival)
    if not stamps:
        raise RecordError(f"{path}: topic {topic} has no usable joint states; choose another with "
                          "--topic NAME")
    origin = stamps[0]
    table = np.array(rows).reshape(len(stamps), 3, len(names))
    late = (np.array(arrivals) - np.array(stamps)) * 1e-9
    return ({"time": (np.array(stamps) - origin) * 1e-9, "q": table[:, 0], "dq": table[:, 1],
             "tau": table[:, 2]},
            {"names": names, "skipped": skipped, "origin": origin,
             "late": float(np.median(np.abs(late)))})


def _filled(values: Sequence[float], order: Sequence[int]) -> list[float]:
    return [values[k] if len(values) == len(order) else np.nan for k in order]


def _commands(bag: Any, topic: str, kind: str,
              names: Sequence[str]) -> tuple[dict[str, np.ndarray], str]:
    """Times and values of commands, and whether they are u or qd."""
    stamps, rows, signal = [], [], "u"
    for arrival, message in _messages(bag, topic):
        info = _command(message, kind, names)
        if info is not None:
            signal, values = info
            stamps.append(_stamp(message, arrival))
            rows.append(values)
    if not rows:
        raise RecordError(f"topic {topic} has no command for the joints {', '.join(names)}; it "
                          f"holds {kind}, and known are {', '.join(sorted(COMMANDS))}")
    return {"command_stamps": np.array(stamps, np.int64), "command": np.array(rows)}, signal


def _command(message: Any, kind: str, names: Sequence[str]) -> tuple[str, list[float]] | None:
    if kind == "std_msgs/msg/Float64MultiArray" and len(message.data) == len(names):
        return "u", list(message.data)
    if kind == "trajectory_msgs/msg/JointTrajectory" and message.points:
        values, order = message.points[0].positions, list(message.joint_names)
        return ("qd", [values[order.index(name)] for name in names]) \
            if set(order) == set(names) and len(values) == len(names) else None
    if kind == STATES and set(message.name) == set(names):
        signal, values = ("u", message.effort) if len(message.effort) else ("qd", message.position)
        order = [message.name.index(name) for name in names]
        return (signal, _filled(values, order))
    return None


def _record(arrays: Mapping[str, np.ndarray], info: Mapping[str, Any], path: str) -> Record:
    time = arrays["time"]
    ranges, notes = segments(time)
    twins, twin_notes = repeated_stamps(time)
    signals: dict[str, Any] = {name: read_only(arrays[name]) for name in ("dq", "tau")
                               if np.isfinite(arrays[name]).any()}
    valid = np.isfinite(arrays["q"]).all(axis=1) & ~twins
    if "command" in arrays:
        stamps = (arrays["command_stamps"] - info["origin"]) * 1e-9
        value, early = hold_last(stamps, arrays["command"], time)
        signals[info["command"]] = read_only(value)
        valid &= np.isfinite(value).all(axis=1)
        notes.append(f"{info['command']} is the command on {info['command_topic']}, held from "
                     f"its time to the next; {early} states come before the first command.")
    return Record(time=time, q=arrays["q"], **signals, valid=valid, joints=info["names"],
                  source=f"{path} {info['topic']}", segments=ranges,
                  decisions=(*_remarks(info), *notes, *twin_notes))


def _remarks(info: Mapping[str, Any]) -> list[str]:
    notes = ["Stamps are those in the message headers; the first one became 0 s."]
    if info.get("unnamed"):
        notes.append("The commands carry no joint names; took their order from the states: "
                     f"{', '.join(info['names'])}.")
    if info["late"] > LATE:
        notes.append(f"Messages arrived {info['late']:.3g} s from their stamp (median); two "
                     "clocks may be involved.")
    if info["skipped"]:
        notes.append(f"{info['skipped']} messages name other joints and were left out; there may "
                     "be several publishers.")
    if info["command_topic"] is None and info["others"]:
        notes.append("No command topic was given; candidates are "
                     f"{', '.join(info['others'])} (--command-topic).")
    return notes
