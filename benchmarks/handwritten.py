"""The CASE 2 loop in hand-written C, built with the system compiler when first asked for."""

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np

from clie_blocks import paper
from clie_blocks.errors import ClieError

SOURCE = Path(__file__).with_name("clie_loop.c")
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")
STATES = 22

CProgram = Callable[..., None]  # the ``run`` of the C file


class Robot(ctypes.Structure):
    """The parameters of the C program."""

    _fields_ = [(name, ctypes.c_double * 2) for name in ("a", "b", "d", "kp", "kd", "q_d")] + [
        (name, ctypes.c_double) for name in ("gamma", "alpha", "highpass", "lowpass", "omega_f")]


def compiler() -> str:
    """Return the system's C compiler."""
    path = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if not path:
        raise ClieError("the benchmark compares with hand-written C and finds no C compiler; "
                        "install gcc or clang, or name one in CC")
    return path


def build(folder: str | os.PathLike[str]) -> CProgram:
    """Compile the loop and return its ``run``."""
    library = Path(folder) / "clie_loop.so"
    subprocess.run([compiler(), *FLAGS, str(SOURCE), "-o", str(library), "-lm"], check=True)
    run = ctypes.CDLL(str(library)).run
    run.restype = None
    run.argtypes = [ctypes.c_long, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p,
                    ctypes.POINTER(Robot), ctypes.c_long, ctypes.c_void_p]
    return run


def simulate(run: CProgram, noise: np.ndarray, q_d: np.ndarray, step: float,
             every: int) -> np.ndarray:
    """Run the C program over all rows of noise; returns the logged states."""
    pair = ctypes.c_double * 2
    a, b, d = paper.THETA.reshape(3, 2)
    robot = Robot(*(pair(*values) for values in (a, b, d, paper.KP, paper.KD, q_d)), paper.GAMMA,
                  paper.ALPHA[2], paper.OMEGA_HIGHPASS, paper.OMEGA_LOWPASS, paper.OMEGA_F)
    x, log = np.zeros(STATES), np.zeros((len(noise) // every + 1, STATES))
    run(len(noise), step, x.ctypes.data, noise.ctypes.data, ctypes.byref(robot), every,
        log.ctypes.data)
    return log
