"""What a caller may say about a log, and how faults of foreign libraries become words."""

import contextlib
import dataclasses

from clie_blocks.errors import ClieError, MissingExtraError, RecordError


@dataclasses.dataclass(frozen=True)
class Options:
    """What is known beside the file.

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

    robot: object = None
    columns: dict | None = None
    time_unit: str | None = None
    topic: str | None = None
    command_topic: str | None = None


@contextlib.contextmanager
def foreign(source, what):
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
        words = str(error).splitlines() or [type(error).__name__]
        raise RecordError(f"{source} cannot be read as {what}: {words[0][:200]}; the file is "
                          "damaged or of another format, export it again") from None


def need(module, job, extra, package=None):
    """Import an optional dependency, or say which extra brings it.

    Parameters
    ----------
    module : str
        What to import.
    job : str
        What it is for.
    extra : str
        Name of the extra.
    package : str, optional
        Name on the package index where it differs from the module.

    """
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingExtraError(job, package or module.split(".")[0], extra) from None
