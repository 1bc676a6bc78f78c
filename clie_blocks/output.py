"""What a command shares with every other: options, tables, files written whole, exit codes."""

from __future__ import annotations

import argparse
import contextlib
import contextvars
import html
import io
import json
import os
import sys
import tempfile
import textwrap
import weakref
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clie_blocks.errors import ClieError, visible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 100  # columns of a terminal that a verdict keeps to
TRACEBACK = "CLIE_TRACEBACK"  # of the environment: show where an unexpected error was raised
Main = Callable[[list[str] | None], int | None]
_SAY: contextvars.ContextVar[Callable[[str], None] | None] = contextvars.ContextVar(
    "say", default=None)  # renames the progress that is shown, if one is

_ALT: weakref.WeakKeyDictionary[Figure, tuple[str, str]] = weakref.WeakKeyDictionary()


def write(path: str | os.PathLike[str], content: str | bytes) -> Path:
    """Write a file atomically: a reader sees the old file or the whole new one.

    Missing parent folders are made.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise ClieError(f"cannot write {path}: {error.strerror}; choose another folder with -o "
                        "DIR") from None
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(scratch, 0o666 & ~_umask())
        os.replace(scratch, path)
    except OSError as error:
        raise ClieError(f"cannot write {path}: {error.strerror}; what stood there before is "
                        "untouched") from None
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(scratch)
    return path


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current


def plain(text: str) -> str:
    """Return a text for a picture, where a dollar would begin a formula."""
    return visible(text, keep="\n").replace("$", r"\$")


def save_figure(figure: Figure, folder: str | os.PathLike[str], stem: str,
                formats: tuple[str, ...] = ("png", "svg")) -> list[str]:
    """Save a Matplotlib figure as ``STEM.png``, ``STEM.svg`` and return the paths."""
    import matplotlib

    paths = []
    for ending in formats:
        buffer = io.BytesIO()
        stamp = {"Date": None} if ending == "svg" else None
        with matplotlib.rc_context({"svg.hashsalt": stem}):  # same figure, same bytes
            figure.savefig(buffer, format=ending, metadata=stamp)
        content = buffer.getvalue()
        if ending == "svg" and figure in _ALT:
            content = _with_alt(content, stem, *_ALT[figure])
        paths.append(str(write(Path(folder) / f"{stem}.{ending}", content)))
    return paths


def describe(figure: Figure, title: str, description: str) -> None:
    """Give a figure the words that `save_figure` writes into its SVG, for readers of screens."""
    _ALT[figure] = title, description


def description(figure: Figure) -> str:
    """Words that `describe` gave a figure; empty if none."""
    return " ".join(_ALT.get(figure, ()))


def _with_alt(svg: bytes, stem: str, title: str, text: str) -> bytes:
    """Mark an SVG as one picture, with its title and its description."""
    name = html.escape(stem)
    head = (f'<svg role="img" aria-labelledby="{name}-title {name}-desc" '.encode(),
            f'<title id="{name}-title">{html.escape(visible(title))}</title>'
            f'<desc id="{name}-desc">{html.escape(visible(text))}</desc>'.encode())
    start = svg.index(b"<svg ")
    end = svg.index(b">", start) + 1
    return svg[:start] + head[0] + svg[start + len(b"<svg "):end] + b"\n" + head[1] + svg[end:]


def to_json(result: object) -> str:
    """Return valid JSON text of a result: arrays as lists, NaN and infinity as null."""
    return json.dumps(json_types(result), indent=2, allow_nan=False)


def json_types(value: Any) -> Any:
    """Return a result in the types of JSON: arrays as lists, NaN and infinity as None."""
    if isinstance(value, dict):
        return {str(key): json_types(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return json_types(value.tolist())
    if isinstance(value, (list, tuple)):
        return [json_types(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def short_repr(thing: object, names: Iterable[str], most: int = 100) -> str:
    """Return the fields of an object that are stated, in a line of at most `most` characters."""
    said = [f"{name}={_short_value(getattr(thing, name))}" for name in names
            if getattr(thing, name) is not None]
    text = ", ".join(said)
    room = most - len(type(thing).__name__) - 2
    return f"{type(thing).__name__}({text if len(text) <= room else text[:room - 3] + '...'})"


def _short_value(value: Any) -> str:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_short_value, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else repr(value)


@contextlib.contextmanager
def progress(label: str, total: float | None = None) -> Iterator[Callable[[float], None]]:
    """Progress on stderr, for work over two seconds; silent when nobody watches.

    Yields ``advance(amount)``, which reports work done in the unit of `total`; without a total the
    time since the start is shown.  Within another progress only that one is shown.
    """
    if _SAY.get() is not None or not sys.stderr.isatty():
        yield lambda amount: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    text = TextColumn("{task.description}", markup=False)
    columns = (text, BarColumn(), TimeElapsedColumn()) if total is None else (
        text, BarColumn(), TextColumn("{task.percentage:3.0f}%"), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=total)
        said = _SAY.set(lambda part: bar.update(task, description=f"{label}: {part}"))
        try:
            yield lambda amount: bar.advance(task, amount)
        finally:
            _SAY.reset(said)


def report_stage(name: str) -> None:
    """Name the part of the work that begins, in the progress that is shown."""
    say = _SAY.get()
    if say is not None:
        say(name)


def command_parser(prog: str, description: str, *, output: str | None = None,
                   output_help: str = "folder for the report", epilog: str | None = None,
                   ) -> argparse.ArgumentParser:
    """Parser with the options of every command: ``--json`` and ``-o DIR``.

    Parameters
    ----------
    prog : str
        The command, as typed.
    description : str
        What it does.
    output : str, optional
        Default of ``-o``; without one, nothing is written unless the user asks for it.
    output_help : str
        What ``-o`` writes.
    epilog : str, optional
        Last lines of the help, such as the exit codes.

    """
    parser = argparse.ArgumentParser(prog=prog, description=description, epilog=epilog,
                                     formatter_class=_HelpWithDefaults)
    parser.add_argument("--json", action="store_true",
                        help="print the result as JSON, with a schema_version")
    parser.add_argument("-o", "--output", metavar="DIR", default=output, help=output_help)
    return parser


class _HelpWithDefaults(argparse.ArgumentDefaultsHelpFormatter):
    """Help that ends in the default of an option, where it has one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        plain = action.default is None or action.default is False or action.default in ("", [], ())
        if isinstance(action.default, (list, tuple)) and not plain:
            return f"{action.help} (default: {' '.join(f'{one:g}' for one in action.default)})"
        return action.help if plain else super()._get_help_string(action)


def counted(number: int, thing: str) -> str:
    """Return a number of things in words: ``1 joint``, ``2 joints``."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def wrapped(text: str, indent: str = "") -> str:
    """Return a sentence for a terminal: lines of at most `WIDTH` columns, the rest indented."""
    return textwrap.fill(text, WIDTH, initial_indent=indent, subsequent_indent=f"{indent}  ",
                         break_long_words=False, break_on_hyphens=False)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], align: str = "") -> None:
    """Print a table of text cells: drawn on a terminal, plain columns in a file or a pipe.

    Parameters
    ----------
    head : sequence of str
        Column heads.
    rows : sequence of sequence of str
        Cells.
    align : str
        Per column ``<`` or ``>``; by default all but the first to the right.

    """
    if not sys.stdout.isatty():
        print(format_table(head, rows, align))
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title, side in zip(head, _sides(align, len(head)), strict=True):
        table.add_column(Text(title), justify="left" if side == "<" else "right")
    for row in rows:
        table.add_row(*map(Text, row))
    Console().print(table)


def format_table(head: Sequence[str], rows: Sequence[Sequence[str]], align: str = "") -> str:
    """Table as plain text, two spaces between columns; arguments as `print_table`.

    A table of more than `WIDTH` columns goes on below, its first column repeated.
    """
    lines = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    sides = _sides(align, len(head))
    return "\n\n".join(
        "\n".join("  ".join(f"{line[k]:{sides[k]}{widths[k]}}" for k in shown).rstrip()
                  for line in lines) for shown in _columns_that_fit(widths))


def _columns_that_fit(widths: Sequence[int]) -> list[list[int]]:
    """Columns of the parts in which a table fits the terminal; each begins with the first."""
    parts, used = [[0]], widths[0]
    for k, width in enumerate(widths[1:], 1):
        if used + 2 + width > WIDTH and len(parts[-1]) > 1:
            parts, used = [*parts, [0]], widths[0]
        parts[-1].append(k)
        used += 2 + width
    return parts


def _sides(align: str, count: int) -> str:
    return align or "<" + ">" * (count - 1)


def run_main(main: Main) -> None:
    """Run a script's ``main()`` and exit: an error in words and its code, never a traceback."""
    sys.exit(guarded(main))


def guarded(main: Main, argv: list[str] | None = None) -> int:
    """Return the exit code of ``main(argv)``; errors go to stderr in words.

    The code is 0 ok, 1 negative result, 2 usage, 3 bad data, 4 not identifiable, 5 diverged,
    70 a fault of this program or 130 interrupted.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a letter that it does not have is written out
            stream.reconfigure(errors="backslashreplace")
    try:
        return main(argv) or 0
    except ClieError as error:
        _print_error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # the reader of our pipe has gone
        return 0
    except Exception as error:
        if os.environ.get(TRACEBACK):
            raise
        _print_error(_fault(error))
        return 3 if isinstance(error, (OSError, MemoryError)) else 70


def _print_error(text: str) -> None:
    """Say an error on stderr: in lines that fit a terminal, else as it is, for `grep`."""
    fit = wrapped if sys.stderr.isatty() else str
    print("\n".join(map(fit, f"error: {text}".split("\n"))), file=sys.stderr)


def _fault(error: Exception) -> str:
    """Message of what no part of the program expected."""
    if isinstance(error, MemoryError):
        return ("there is not enough memory for this; cut the logs into shorter runs, or export "
                "only the signals that are needed")
    if isinstance(error, OSError) and error.filename is not None:
        return visible(f"cannot use {error.filename}: {error.strerror}; check that it exists and "
                       "that you may use it")
    return visible(f"{type(error).__name__}: {error}"[:400] + "; this is a fault of clie, not of "
                   f"your data: please report it with what the same command prints after "
                   f"'export {TRACEBACK}=1'")
