"""A child process with bounded memory and time, for formats whose C readers can be crashed.

SciPy says of its MATLAB reader that it is not hardened, and HDF5 and bag readers trust sizes that
the file states.  Here a hostile file can only end the child.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.readers.options import library_errors
from clie_blocks.errors import RecordError

MEMORY = 4_000_000_000  # bytes of address space
SECONDS = 120  # of waiting, on a machine that has other work
COMPUTING = 20  # s of processor time; a log of a megabyte takes less than one
SPEED = 1_000_000  # bytes per second that may be added to both for a large file
ANSWER, ARRAYS, MESSAGES = "answer.json", "arrays.npz", "messages.txt"  # what the child writes
TOO_LONG = 24  # SIGXCPU
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # threads reserve memory


def run(job: str, path: str | os.PathLike[str], arguments: Mapping[str, Any] | None = None,
        ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return what a function of a reader module finds in a file, computed in a child process.

    Parameters
    ----------
    job : str
        ``module.function`` in this folder; it takes the path and the arguments by name, and
        returns a dict of arrays and a dict that JSON can hold.
    path : path-like
        The log.
    arguments : mapping, optional
        Further arguments, which JSON must be able to hold.

    Raises
    ------
    RecordError
        If the job refuses the file, or the child dies, or needs too much memory or time.

    """
    extra = _size(Path(path)) / SPEED
    here = os.path.abspath(path)
    with tempfile.TemporaryDirectory() as folder:
        order = json.dumps({"job": job, "path": here, "arguments": dict(arguments or {}),
                            "memory": MEMORY, "seconds": int(COMPUTING + extra) + 1})
        try:
            code = _served(order, folder, SECONDS + extra)
        except subprocess.TimeoutExpired:
            raise RecordError(f"{path} took more than {SECONDS + extra:.0f} s to read and was "
                              "given up; export only the signals that are needed") from None
        answer = Path(folder) / ANSWER
        if not answer.exists():
            raise RecordError(_death(path, code, Path(folder) / MESSAGES))
        info = json.loads(answer.read_text())
        if "error" in info:
            raise RecordError(info["error"].replace(here, str(path)))
        with np.load(Path(folder) / ARRAYS, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}, info


def _served(order: str, folder: str, seconds: float) -> int:
    """Run the child in a folder of its own and return its exit status.

    Nothing is imported from the folder that the user works in (``-P``): a folder of downloaded
    logs may hold a ``json.py``.
    """
    with open(Path(folder) / MESSAGES, "wb") as messages:
        return subprocess.run([sys.executable, "-P", "-m", __name__], input=order.encode(),
                              stdout=subprocess.DEVNULL, stderr=messages, timeout=seconds,
                              check=False, cwd=folder, env=_environment()).returncode


def _environment() -> dict[str, str]:
    """Environment of the child: the paths of this one made absolute, no program of its own."""
    places = [os.path.abspath(place) for place in
              os.environ.get("PYTHONPATH", "").split(os.pathsep) if place]
    return {**os.environ, **ONE_THREAD, "PYTHONSAFEPATH": "1",
            "PYTHONPATH": os.pathsep.join(places)}


def _size(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())


def _death(path: str | os.PathLike[str], code: int, messages: Path) -> str:
    if -code == TOO_LONG:
        return (f"{path} kept its reader computing for more than {COMPUTING} s and was given up; "
                "the file is damaged or hostile, export it again")
    if code < 0:
        return (f"{path} crashed its reader (signal {-code}), which runs apart so "
                "that nothing else is hurt; the file is damaged or hostile, export it again")
    lines = messages.read_text(errors="replace").strip().splitlines() or ["no message"]
    return f"{path} could not be read: {lines[-1][:200]}; the file is damaged, export it again"


def serve() -> None:
    """Do the job that stands on stdin; this is the child."""
    import importlib

    order = json.loads(sys.stdin.read())
    _limit(order["memory"], order["seconds"])
    module, function = order["job"].split(".")
    try:
        module = importlib.import_module(f"clie_blocks.analysis.records.readers.{module}")
        with library_errors(order["path"], f"a log by {order['job']}"):
            arrays, info = getattr(module, function)(order["path"], **order["arguments"])
            np.savez(ARRAYS, **arrays)
    except RecordError as error:
        info = {"error": str(error)}
    Path(ANSWER).write_text(json.dumps(info))


def _limit(memory: int, seconds: int) -> None:
    try:
        import resource
    except ImportError:
        return  # not on Windows; the timeout of the parent still holds
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    serve()
