"""What runs a program: machine code, or plain Python."""

import sys
from typing import Protocol

import numpy as np

from clie_blocks.errors import ClieError, nearest


class Engine(Protocol):
    """A program that can run; x, u, p are states, inputs and parameters as it lays them out."""

    cached: bool

    def derivative(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the derivatives of the states."""

    def observe(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the record."""

    def run(self, n: int, h: float, t0: float, first: int, x: np.ndarray, inputs: np.ndarray,
            p: np.ndarray, every: int, slots: np.ndarray, log: np.ndarray) -> int:
        """Take n steps in place and return how many; fills rows of `log` every so many steps."""


def available_engine(engine: str) -> str:
    """Return the engine that can run here: ``'python'`` where llvmlite is missing.

    Raises
    ------
    ClieError
        If there is no such engine.

    """
    if engine not in ("llvm", "python"):
        raise ClieError(f"no engine {engine!r}; {nearest(engine, ['llvm', 'python'])}")
    if engine == "llvm":
        try:
            import llvmlite.binding  # noqa: F401
        except ImportError:
            print("llvmlite is missing: running plain Python, some 400 times slower; "
                  "pip install llvmlite", file=sys.stderr)
            return "python"
    return engine
