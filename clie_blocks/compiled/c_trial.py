"""A function in C, tried in a process of its own, which may crash or never end.

``python c_trial.py`` is that process: it reads what to try as JSON and needs no other module.
Every argument stands between gaps.  What the function writes into a gap, or reads from one, it
does past the end of an argument.
"""

from __future__ import annotations

import ctypes
import json
import math
import random
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any

SAMPLES = 100  # of a run
SECONDS = 10.0  # for all runs
GAP = 8  # numbers, before and behind every argument
ORDINARY, UNUSUAL = "ordinary", "unusual"
UNUSUAL_NUMBERS = (1e12, -1e12, math.inf, -math.inf, math.nan)
_GUARD, _READ = 1.2345678e-199, 0.5  # in a gap of the results, and of the operands
WRITES, READS, REMEMBERS = "writes", "reads", "remembers"


def tried(order: Mapping[str, Any]) -> tuple[str, str]:
    """Try a function in a child process.

    Parameters
    ----------
    order : mapping
        ``library`` (path) and ``symbol`` of the function, and its arguments as lists of (name,
        place, size): ``inputs``, ``states`` and ``parameters`` in the operands, ``after`` (the
        states) and ``outputs`` in the results, with the ``values`` of the parameters; and
        ``operands`` and ``results``, the lengths of both.

    Returns
    -------
    stage : str
        In which it failed: `ORDINARY` or `UNUSUAL` numbers; empty if it did not.
    fault : str
        ``'signal 11'``, ``'time'``, or `WRITES`, `READS` or `REMEMBERS` with the name of the
        argument, if there is one.

    """
    command = [sys.executable, "-I", __file__]
    try:
        done = subprocess.run(command, input=json.dumps(order), capture_output=True, text=True,
                              timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired as error:
        said = error.stdout or b""
        return _last(said.decode() if isinstance(said, bytes) else said), "time"
    if done.returncode < 0:
        return _last(done.stdout), f"signal {-done.returncode}"
    if done.returncode:
        return _last(done.stdout), f"exit {done.returncode}"
    *_, last = done.stdout.split("\n", 2)
    return (ORDINARY, last.strip()) if last.strip() else ("", "")


def _last(said: str) -> str:
    return UNUSUAL if UNUSUAL in said else ORDINARY


class _Trial:
    """The function with its memory."""

    def __init__(self, order: Mapping[str, Any]) -> None:
        self.order = order
        self.function = ctypes.CDLL(order["library"])[order["symbol"]]
        self.function.restype = None
        self.given = (ctypes.c_double * order["operands"])()
        self.results = (ctypes.c_double * order["results"])()

    def run(self, gap: float) -> list[bytes]:
        """Results of every sample from zero states, with a number in the gaps of the operands."""
        random_numbers, state = random.Random(1), [0.0] * self._size("states")
        rows = []
        for _ in range(SAMPLES):
            inputs = [random_numbers.uniform(-1, 1) for _ in range(self._size("inputs"))]
            after, row = self.sample(inputs, state, gap)
            rows.append(row)
            state = [value if math.isfinite(value) else 0.0 for value in after]
        return rows

    def sample(self, inputs: Sequence[float], state: Sequence[float], gap: float,
               ) -> tuple[list[float], bytes]:
        """Next state, and all results as bytes."""
        for k in range(len(self.given)):
            self.given[k] = gap
        for k in range(len(self.results)):
            self.results[k] = _GUARD
        for kind, values in (("inputs", inputs), ("states", state),
                             ("parameters", self.order["values"])):
            numbers = iter(values)
            for _, place, size in self.order[kind]:
                for k in range(size):
                    self.given[place + k] = next(numbers)
        self.function(self.given, self.results)
        after = [self.results[place + k] for _, place, size in self.order["after"]
                 for k in range(size)]
        outputs = [self.results[place + k] for _, place, size in self.order["outputs"]
                   for k in range(size)]
        return after, struct.pack(f"{len(after) + len(outputs)}d", *after, *outputs)

    def overwritten(self) -> str:
        """Argument of the results beside which something was written; empty for none."""
        places = [(name, place, size) for kind in ("after", "outputs")
                  for name, place, size in self.order[kind]]
        for name, place, size in places:
            for k in (*range(place - GAP, place), *range(place + size, place + size + GAP)):
                if self.results[k] != _GUARD:
                    return name
        return ""

    def _size(self, kind: str) -> int:
        return sum(size for _, _, size in self.order[kind])


def _fault(trial: _Trial) -> str:
    first, again, other_gap = trial.run(math.nan), trial.run(math.nan), trial.run(_READ)
    overwritten = trial.overwritten()
    if overwritten:
        return f"{WRITES} {overwritten}"
    return REMEMBERS if first != again else READS if first != other_gap else ""


def main() -> None:
    """Try what the order on the standard input says, and print the stages and the fault."""
    trial = _Trial(json.load(sys.stdin))
    print(ORDINARY, flush=True)
    fault = _fault(trial)
    print(UNUSUAL, flush=True)
    for number in UNUSUAL_NUMBERS if not fault else ():
        inputs, states = (trial.order[kind] for kind in ("inputs", "states"))
        trial.sample([number] * sum(size for _, _, size in inputs),
                     [number] * sum(size for _, _, size in states), math.nan)
    print(fault)


if __name__ == "__main__":
    main()
