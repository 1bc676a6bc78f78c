"""The C export as an engine of the tests: derivatives at a point."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.compiled.codegen import c
from clie_blocks.compiled.ir.parameters import Parameters

STRICT = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]


def shared_library(text, folder):
    """Compile C text under strict rules and load it; skip the test where there is no compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler called cc")
    (Path(folder) / "p.c").write_text(text)
    subprocess.run([compiler, *STRICT, "-shared", "-fPIC", "p.c", "-o", "p.so", "-lm"],
                   cwd=folder, check=True)
    return ctypes.CDLL(str(Path(folder) / "p.so"))


class CEngine:
    """Expressions of x as the outputs of an exported program."""

    def __init__(self, layout, method):
        text = c.source("p", layout, layout.derivatives, Parameters(), method, [])
        with tempfile.TemporaryDirectory() as folder:
            self._output = shared_library(text, folder).p_output
        self._output.restype, self._size = None, len(layout.derivatives)

    def derivative(self, t, x, u, p):
        x, result = np.ascontiguousarray(x, float), np.zeros(self._size)
        self._output(ctypes.c_double(t), *(ctypes.c_void_p(array.ctypes.data)
                                           for array in (x, result, x, result)))
        return result
