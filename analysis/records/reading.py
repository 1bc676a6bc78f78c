"""Options of every command that reads logs: which column is which signal, clock, topics."""

import argparse
import dataclasses
from typing import Any


@dataclasses.dataclass(frozen=True)
class Reading:
    """What a user states about the logs, as keywords of `read_records`.

    Parameters
    ----------
    columns : tuple of (str, str)
        Signal and column pattern.
    time_unit, topic, command_topic : str, optional
        As for `read_records`.

    """

    columns: tuple[tuple[str, str], ...] = ()
    time_unit: str | None = None
    topic: str | None = None
    command_topic: str | None = None

    def keywords(self) -> dict[str, Any]:
        """Keywords of `read_records`."""
        return {"columns": dict(self.columns) or None, "time_unit": self.time_unit,
                "topic": self.topic, "command_topic": self.command_topic}

    def arguments(self) -> list[str]:
        """The options of a command that state the same."""
        stated = {"--time-unit": self.time_unit, "--topic": self.topic,
                  "--command-topic": self.command_topic}
        return [*(word for pair in self.columns for word in ("--map", "=".join(pair))),
                *(word for option, value in stated.items() if value for word in (option, value))]


def add_reading_options(parser: argparse.ArgumentParser) -> None:
    """Give a command the options that say how logs are read."""
    parser.add_argument("--map", action=_Map, type=_pair, default=(), metavar="SIGNAL=COLUMN",
                        help="name a column, as q=actual_pos_{joint} or u=motor{k}; once for each "
                             "signal (time, q, u, qd, pe, dq, tau)")
    parser.add_argument("--time-unit", choices=("s", "ms", "us", "ns"), help="unit of the clock")
    parser.add_argument("--topic", metavar="NAME", help="joint states in a ROS bag")
    parser.add_argument("--command-topic", metavar="NAME", help="commands in a ROS bag")


def reading(options: argparse.Namespace) -> Reading:
    """Return what a user stated about the logs."""
    return Reading(tuple(options.map), options.time_unit, options.topic, options.command_topic)


class _Map(argparse.Action):
    """Collects the columns of the signals; a signal has one."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: str | None = None) -> None:
        stated = getattr(namespace, self.dest)
        if values[0] in dict(stated):
            parser.error(f"--map names two columns for {values[0]}: {dict(stated)[values[0]]} and "
                         f"{values[1]}; a signal has one pattern for all joints, as "
                         f"{values[0]}=name_{{joint}}")
        setattr(namespace, self.dest, (*stated, values))


def _pair(text: str) -> tuple[str, str]:
    signal, separator, column = text.partition("=")
    if not separator or not signal or not column:
        raise argparse.ArgumentTypeError(f"{text!r} is not SIGNAL=COLUMN, as "
                                         "q=actual_pos_{joint}")
    return signal, column
