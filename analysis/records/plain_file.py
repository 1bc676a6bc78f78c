"""What is read must be a file: a pipe or a device may never end, and cannot be read twice."""

import stat
from pathlib import Path

from clie_blocks.errors import RecordError


def check_plain_file(path: Path) -> None:
    """Refuse a pipe, a socket or a device; a fault of the path itself is an `OSError`."""
    try:
        mode = path.stat().st_mode
    except ValueError as error:  # a character of the name that no file system takes
        raise RecordError(f"{str(path)!r} cannot be the name of a file: {error}; check the "
                          "spelling") from None
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise RecordError(f"{path} is a pipe or a device, and what is read more than once must "
                          "be a file; write its content to a file and name that one")
