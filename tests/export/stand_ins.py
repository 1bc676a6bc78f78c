"""C++ compiled against stand-ins for the headers of a simulator, in the folder `stubs`."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.export.test_cores import COMPILER

STUBS = Path(__file__).parent / "stubs"
CXX = next((found for name in ("c++", "g++", "clang++") if (found := shutil.which(name))), None)
needs_cxx = pytest.mark.skipif(not (COMPILER and CXX), reason="needs a C++ compiler")


def compiled(folder, source, run, header):
    """The library of a C++ source with its C file, of `run`, where a header stands for an API."""
    for path in included(folder / source):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(f'#include "{STUBS / header}"\n')
    flags = ["-Wall", "-Wextra", "-Werror", "-fPIC", "-ffp-contract=off"]
    subprocess.run([COMPILER, "-std=c99", *flags, "-c", "j1.c"], cwd=folder, check=True)
    subprocess.run([CXX, "-std=c++17", *flags, "-I.", "-shared", "-o", "run.so", str(STUBS / run),
                    "j1.o", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "run.so"))


def included(path):
    """Headers of an API that a source includes."""
    return re.findall(r'#include [<"](.*\.(?:hh|hpp))[>"]', path.read_text())


def pointer(values):
    """An array as C takes it."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
