"""What a caller may state about a log, and how faults of format libraries become messages."""

import contextlib
import dataclasses
import os
from collections.abc import Iterator, Mapping
from typing import Any

from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import ClieError, MissingExtraError, RecordError


@dataclasses.dataclass(frozen=True)
class Options:
    """What is known besides the file.

    Parameters
    ----------
    robot : Robot, optional
        The robot.
    columns : mapping, optional
        Signal to column pattern.
    time_unit : str, optional
        Unit of the clock.
    topic, command_topic : str, optional
        Of a bag: where the joint states are, and where the commands are.

    """

    robot: Robot | None = None
    columns: Mapping[str, str] | None = None
    time_unit: str | None = None
    topic: str | None = None
    command_topic: str | None = None


@contextlib.contextmanager
def library_errors(source: str | os.PathLike[str], what: str) -> Iterator[None]:
    """Turn whatever a format's library raises on a damaged file into a `RecordError`."""
    try:
        yield
    except ClieError:
        raise
    except ImportError:
        raise
    except MemoryError:
        raise RecordError(f"{source} needs more memory than there is; export only the signals "
                          "that are needed") from None
    except Exception as error:
        reason = str(error).splitlines() or [type(error).__name__]
        raise RecordError(f"{source} cannot be read as {what}: {reason[0][:200]}; the file is "
                          "damaged or of another format, export it again") from None


def need(module: str, job: str, extra: str, package: str | None = None) -> Any:
    """Import an optional dependency, or name the extra that installs it for the job.

    `package` is its name on the package index where that differs from the module.
    """
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingExtraError(job, package or module.split(".")[0], extra) from None
