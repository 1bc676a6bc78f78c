"""What an export makes: files, and what their user must know."""

from __future__ import annotations

import dataclasses
import difflib
from os import PathLike
from pathlib import Path

from clie_blocks.errors import RecordError
from clie_blocks.output import write


@dataclasses.dataclass(frozen=True)
class Exported:
    """Files of an export, and notes.

    Parameters
    ----------
    target : str
        Name of the target.
    files : dict
        Content by name; text, or bytes of a binary file.
    notes : tuple of str
        What is left out, and what the user must do.
    diff : str
        Change of the user's own file as a unified diff; empty where there is none.
    ran : str
        What was checked here, in one sentence.

    """

    target: str
    files: dict[str, str | bytes]
    notes: tuple[str, ...] = ()
    diff: str = ""
    ran: str = ""

    def save(self, folder: str | PathLike[str]) -> list[Path]:
        """Write the files into a folder, and return their paths."""
        return [write(Path(folder) / name, content) for name, content in self.files.items()]


def unified_diff(before: str, after: str, name: str, other: str) -> str:
    """Return the change of a file as a unified diff."""
    lines = difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, other)
    return "".join(line if line.endswith("\n") else f"{line}\n" for line in lines)


def read_model(path: Path, what: str, otherwise: str) -> str:
    """Return the text of the user's model.

    Raises
    ------
    RecordError
        If it cannot be read; says what to give, and what is written without.

    """
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"{path} cannot be read ({error}); give {what}, or leave out --model "
                          f"for {otherwise}") from None
