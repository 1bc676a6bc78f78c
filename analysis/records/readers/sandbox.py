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
SECONDS = 120
SPEED = 1_000_000  # bytes per second that may be added for a large file
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
    seconds = SECONDS + _size(Path(path)) / SPEED
    with tempfile.TemporaryDirectory() as folder:
        order = json.dumps({"job": job, "path": str(path), "arguments": dict(arguments or {}),
                            "folder": folder, "memory": MEMORY, "seconds": int(seconds) + 1})
        try:
            child = subprocess.run([sys.executable, "-m", __name__], input=order.encode(),
                                   capture_output=True, timeout=seconds, check=False,
                                   env={**os.environ, **ONE_THREAD})
        except subprocess.TimeoutExpired:
            raise RecordError(f"{path} took more than {seconds:.0f} s to read and was given up; "
                              "export only the signals that are needed") from None
        answer = Path(folder) / "answer.json"
        if not answer.exists():
            raise RecordError(_death(path, child))
        info = json.loads(answer.read_text())
        if "error" in info:
            raise RecordError(info["error"])
        with np.load(Path(folder) / "arrays.npz", allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}, info


def _size(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())


def _death(path: str | os.PathLike[str], child: subprocess.CompletedProcess[bytes]) -> str:
    if child.returncode < 0:
        return (f"{path} crashed its reader (signal {-child.returncode}), which runs apart so "
                "that nothing else is hurt; the file is damaged or hostile, export it again")
    lines = child.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
    return f"{path} could not be read: {lines[-1][:200]}; the file is damaged, export it again"


def serve() -> None:
    """Do the job that stands on stdin; this is the child."""
    import importlib

    order = json.loads(sys.stdin.read())
    _limit(order["memory"], order["seconds"])
    module, function = order["job"].split(".")
    folder = Path(order["folder"])
    try:
        module = importlib.import_module(f"clie_blocks.analysis.records.readers.{module}")
        with library_errors(order["path"], f"a log by {order['job']}"):
            arrays, info = getattr(module, function)(order["path"], **order["arguments"])
            np.savez(folder / "arrays.npz", **arrays)
    except RecordError as error:
        info = {"error": str(error)}
    (folder / "answer.json").write_text(json.dumps(info))


def _limit(memory: int, seconds: int) -> None:
    try:
        import resource
    except ImportError:
        return  # not on Windows; the timeout of the parent still holds
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    serve()
