"""Python files of the user's own, which are run: effects of a catalogue, a control law."""

from __future__ import annotations

import contextlib
import runpy
import traceback
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

from clie_blocks.errors import ClieError

MEMORY = 2 * 2**30  # bytes that a file may take: far more than blocks need


def run_file(path: str | PathLike[str], what: str) -> dict[str, Any]:
    """Run a file that the user trusts, and return what it defines.

    Parameters
    ----------
    path : path-like
        The file.
    what : str
        What it is, for the message, such as ``'file of effects'``.

    Raises
    ------
    ClieError
        If the file cannot be read, fails or takes too much memory; says in which line.

    """
    file = Path(path).resolve()
    try:
        with _memory_limit(MEMORY):
            return runpy.run_path(str(file))
    except MemoryError as error:
        raise ClieError(f"{path}:{_line_of(error, file)}: the {what} takes more than "
                        f"{MEMORY / 2**30:.0f} GiB of memory; make only what its blocks "
                        "need") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ClieError(f"{path}: the {what} cannot be read: {error}") from None
    except (Exception, SystemExit) as error:
        raise ClieError(f"{path}:{_line_of(error, file)}: {type(error).__name__}: {error}; mend "
                        f"the line, the {what} must run by itself") from None


@contextlib.contextmanager
def _memory_limit(extra: int) -> Iterator[None]:
    """Let the process allocate so many bytes beyond what it has, where the system can."""
    try:
        import resource

        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except (ImportError, OSError):
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    lowest = min(value for value in (soft, used + extra) if value != resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_AS, (lowest, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _line_of(error: BaseException, file: Path) -> int:
    """Last line of a file that took part in an error."""
    if isinstance(error, SyntaxError) and error.lineno:
        return error.lineno
    lines = [frame.lineno or 1 for frame in traceback.extract_tb(error.__traceback__)
             if frame.filename == str(file)]
    return lines[-1] if lines else 1
