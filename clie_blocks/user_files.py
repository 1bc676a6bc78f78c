"""Python files of the user's own, which are run: effects of a catalogue, a control law."""

from __future__ import annotations

import runpy
import traceback
from os import PathLike
from pathlib import Path
from typing import Any

from clie_blocks.errors import ClieError


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
        If the file cannot be read or fails; says in which line.

    """
    file = Path(path).resolve()
    try:
        return runpy.run_path(str(file))
    except (OSError, UnicodeDecodeError) as error:
        raise ClieError(f"{path}: the {what} cannot be read: {error}") from None
    except (Exception, SystemExit) as error:
        raise ClieError(f"{path}:{_line_of(error, file)}: {type(error).__name__}: {error}; mend "
                        f"the line, the {what} must run by itself") from None


def _line_of(error: BaseException, file: Path) -> int:
    """Last line of a file that took part in an error."""
    if isinstance(error, SyntaxError) and error.lineno:
        return error.lineno
    lines = [frame.lineno or 1 for frame in traceback.extract_tb(error.__traceback__)
             if frame.filename == str(file)]
    return lines[-1] if lines else 1
