"""What a run leaves behind: files written whole or not at all, progress, exit codes."""

import contextlib
import json
import os
import sys
import tempfile
from pathlib import Path

from clie_blocks.errors import ClieError


def write(path, content):
    """Write a file atomically: a reader sees the old file or the whole new one.

    Parameters
    ----------
    path : path-like
        The file; missing parent folders are made.
    content : str or bytes
        Its content.

    Returns
    -------
    pathlib.Path
        The path.

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


def _umask():
    current = os.umask(0)
    os.umask(current)
    return current


def save_figure(figure, folder, stem, formats=("png", "svg")):
    """Save a Matplotlib figure in each format and return the paths as strings.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure.
    folder : path-like
        Where to.
    stem : str
        File name without its ending.
    formats : tuple of str
        Endings.

    Returns
    -------
    list of str
        One path per format.

    """
    import io

    import matplotlib

    paths = []
    for ending in formats:
        buffer = io.BytesIO()
        stamp = {"Date": None} if ending == "svg" else None
        with matplotlib.rc_context({"svg.hashsalt": stem}):  # same figure, same bytes
            figure.savefig(buffer, format=ending, metadata=stamp)
        paths.append(str(write(Path(folder) / f"{stem}.{ending}", buffer.getvalue())))
    return paths


def to_json(result):
    """Return valid JSON text of a result: arrays as lists, NaN and infinity as null.

    Parameters
    ----------
    result : dict
        Numbers, strings, arrays, lists and dicts.

    Returns
    -------
    str
        JSON with two spaces of indent.

    """
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value):
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


@contextlib.contextmanager
def progress(label, total):
    """Progress line on stderr, for work over two seconds; silent when nobody watches.

    Parameters
    ----------
    label : str
        What is being done.
    total : float
        The amount of work.

    Yields
    ------
    callable
        ``advance(amount)`` reports work done.

    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(),
               TextColumn("{task.percentage:3.0f}%"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True,
                  disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=total)
        yield lambda amount: bar.advance(task, amount)


def run_main(main):
    """Run a script's ``main()`` and exit: an error in words and its code, never a traceback.

    Parameters
    ----------
    main : callable
        Takes a list of arguments or None and returns an exit code or None.

    """
    sys.exit(guarded(main))


def guarded(main, argv=None):
    """Return the exit code of ``main(argv)``; errors go to stderr in words.

    Parameters
    ----------
    main : callable
        Takes a list of arguments or None and returns an exit code or None.
    argv : list of str, optional
        The arguments; by default those of the process.

    Returns
    -------
    int
        0 ok, 1 bad news, 2 usage, 3 bad data, 4 not identifiable, 5 diverged, 130 interrupted.

    """
    try:
        return main(argv) or 0
    except ClieError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # the reader of our pipe has gone
        return 0
