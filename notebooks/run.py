"""Run the notebooks of the course and store them with their outputs: ``python notebooks/run.py``.

Each is written from the file of the same name that ends in .py, which is the one to edit.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

from clie_blocks.analysis.lesson import STATIC
from clie_blocks.output import write

FOLDER = Path(__file__).parent
SOURCES = sorted(FOLDER.glob("[1-9]_*.py"))
REAL = FOLDER.parents[1] / "shared" / "data" / "emps"  # the logs of notebook 5, where they are
TIMEOUT = 120  # s per cell


def run(source: Path, folder: Path = FOLDER) -> nbformat.NotebookNode:
    """Return a notebook with its outputs, as a page shows them without a kernel."""
    notebook = jupytext.read(source)
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"  # the same at every run
    NotebookClient(notebook, timeout=TIMEOUT, kernel_name="python3", record_timing=False,
                   resources={"metadata": {"path": str(folder)}}).execute()
    notebook.metadata.pop("language_info", None)
    notebook.metadata.pop("jupytext", None)
    return notebook


def main(argv: Sequence[str] | None = None) -> int:
    """Write the notebooks that are named, or all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("number", nargs="*", help="of a notebook; by default all")
    numbers = parser.parse_args(argv).number
    os.environ[STATIC] = "1"
    os.environ.setdefault("PYDEVD_DISABLE_FILE_VALIDATION", "1")  # a warning of the kernel
    if REAL.is_dir():
        os.environ.setdefault("EMPS", str(REAL))
    for source in SOURCES:
        if not numbers or source.name[0] in numbers:
            began = time.perf_counter()
            path = write(source.with_suffix(".ipynb"), nbformat.writes(run(source)) + "\n")
            print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB, "
                  f"{time.perf_counter() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
