"""ROS 2 bags (sqlite3 or MCAP): joint states, and the command from another topic."""

import array

import numpy as np

from clie_blocks.analysis.records.clock import repeated, segments
from clie_blocks.analysis.records.model import Record, frozen
from clie_blocks.analysis.records.readers import sandbox
from clie_blocks.analysis.records.readers.options import foreign, need
from clie_blocks.analysis.records.resampling import held
from clie_blocks.errors import RecordError, nearest

STATES = "sensor_msgs/msg/JointState"
COMMANDS = {"sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray",
            "trajectory_msgs/msg/JointTrajectory"}
LATE = 0.1  # s between stamp and arrival worth a word


def read(path, options):
    """Return the record of a bag.

    The stamp in the message's header counts, not the time of recording.  A command holds from its
    own time until the next one; commands arrive as torque (``Float64MultiArray``, or effort of a
    ``JointState``) or as goal (position of a ``JointState``, ``JointTrajectory``).

    """
    need("rosbags.highlevel", "reading ROS 2 bags", "ros", "rosbags")
    arrays, found = sandbox.run("bag.load", path, topic=options.topic,
                                command_topic=options.command_topic)
    return [_record(arrays, found, str(path))]


def load(path, topic, command_topic):
    """Return joint states and commands of a bag; runs in the child.

    Parameters
    ----------
    path : str
        Folder of a bag, or a single .mcap or .db3 file.
    topic, command_topic : str or None
        Where the states and the commands are.

    """
    from pathlib import Path

    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with foreign(path, "a ROS 2 bag"), AnyReader(
            [Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        kinds = {connection.topic: connection.msgtype for connection in bag.connections}
        topic = _one(topic, [name for name, kind in kinds.items()
                             if kind == STATES and name != command_topic], path, "topic", kinds)
        arrays, found = _states(bag, topic, path)
        if command_topic is not None:
            _known(command_topic, kinds, path)
            commands, kind = _commands(bag, command_topic, kinds[command_topic], found["names"])
            arrays.update(commands)
            found["command"] = kind
            found["unnamed"] = kinds[command_topic] == "std_msgs/msg/Float64MultiArray"
    return arrays, {**found, "topic": topic, "command_topic": command_topic,
                    "others": sorted(name for name, kind in kinds.items()
                                     if kind in COMMANDS and name != topic)}


def _one(topic, candidates, path, option, kinds):
    if topic is not None:
        _known(topic, kinds, path)
        return topic
    if len(candidates) != 1:
        what = f"joint states on {', '.join(candidates)}" if candidates else (
            f"no joint states; its topics are {', '.join(kinds) or 'none'}")
        raise RecordError(f"{path} has {what}; say which: --{option} NAME")
    return candidates[0]


def _known(topic, kinds, path):
    if topic not in kinds:
        raise RecordError(f"{path} has no topic {topic!r}; {nearest(topic, kinds)}")


def _messages(bag, topic):
    wanted = [connection for connection in bag.connections if connection.topic == topic]
    for connection, arrival, raw in bag.messages(connections=wanted):
        yield arrival, bag.deserialize(raw, connection.msgtype)


def _stamp(message, arrival):
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    nanoseconds = stamp.sec * 10**9 + stamp.nanosec if stamp is not None else 0
    return nanoseconds or arrival


def _states(bag, topic, path):
    """Stamps, and position, velocity, effort by joint in the order of the first message."""
    names, stamps, arrivals, strange = None, [], [], 0
    rows = array.array("d")  # a tenth of the memory of lists
    for arrival, message in _messages(bag, topic):
        names = names or list(message.name)
        if not names or set(message.name) != set(names) or len(message.position) != len(names):
            strange += 1
            continue
        order = [message.name.index(name) for name in names]
        for part in ("position", "velocity", "effort"):
            rows.extend(_filled(getattr(message, part), order))
        stamps.append(_stamp(message, arrival))
        arrivals.append(arrival)
    if not stamps:
        raise RecordError(f"{path}: topic {topic} has no usable joint states")
    origin = stamps[0]
    table = np.array(rows).reshape(len(stamps), 3, len(names))
    late = (np.array(arrivals) - np.array(stamps)) * 1e-9
    return ({"time": (np.array(stamps) - origin) * 1e-9, "q": table[:, 0], "dq": table[:, 1],
             "tau": table[:, 2]},
            {"names": names, "strange": strange, "origin": origin,
             "late": float(np.median(np.abs(late)))})


def _filled(values, order):
    return [values[k] if len(values) == len(order) else np.nan for k in order]


def _commands(bag, topic, kind, names):
    """Times and values of commands, and whether they are u or qd."""
    stamps, rows, signal = [], [], "u"
    for arrival, message in _messages(bag, topic):
        found = _command(message, kind, names)
        if found is not None:
            signal, values = found
            stamps.append(_stamp(message, arrival))
            rows.append(values)
    if not rows:
        raise RecordError(f"topic {topic} has no command for the joints {', '.join(names)}; it "
                          f"holds {kind}, and known are {', '.join(sorted(COMMANDS))}")
    return {"command_stamps": np.array(stamps, np.int64), "command": np.array(rows)}, signal


def _command(message, kind, names):
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


def _record(arrays, found, path):
    time = arrays["time"]
    ranges, notes = segments(time)
    twins, twin_notes = repeated(time)
    signals = {name: frozen(arrays[name]) for name in ("dq", "tau")
               if np.isfinite(arrays[name]).any()}
    valid = np.isfinite(arrays["q"]).all(axis=1) & ~twins
    if "command" in arrays:
        stamps = (arrays["command_stamps"] - found["origin"]) * 1e-9
        value, early = held(stamps, arrays["command"], time)
        signals[found["command"]] = frozen(value)
        valid &= np.isfinite(value).all(axis=1)
        notes.append(f"{found['command']} is the command on {found['command_topic']}, held from "
                     f"its time to the next; {early} states come before the first command.")
    return Record(time=time, q=arrays["q"], **signals, valid=valid, joints=found["names"],
                  source=f"{path} {found['topic']}", segments=ranges,
                  decisions=(*_remarks(found), *notes, *twin_notes))


def _remarks(found):
    notes = ["Stamps are those in the message headers; the first one became 0 s."]
    if found.get("unnamed"):
        notes.append(f"The commands carry no names; took their order to be that of the states: "
                     f"{', '.join(found['names'])}.")
    if found["late"] > LATE:
        notes.append(f"Messages arrived {found['late']:.3g} s from their stamp (median); two "
                     "clocks may be involved.")
    if found["strange"]:
        notes.append(f"{found['strange']} messages name other joints and were left out; there may "
                     "be several publishers.")
    if found["command_topic"] is None and found["others"]:
        notes.append("No command topic was given; candidates are "
                     f"{', '.join(found['others'])} (--command-topic).")
    return notes
