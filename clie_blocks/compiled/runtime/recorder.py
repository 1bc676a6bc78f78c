"""What a batch keeps of its runs: rows that are logged, and reductions of rows."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clie_blocks.compiled.reduce import Reduction
from clie_blocks.compiled.runtime.arguments import select
from clie_blocks.errors import ClieError

ROOM = 8 << 30  # bytes of rows that a batch may keep


@dataclass(frozen=True)
class Schedule:
    """The length of all runs of a batch, and when rows are kept.

    Parameters
    ----------
    steps, every : int
        Number of steps, and how many of them per row.
    step : float
        Step [s].

    """

    steps: int
    every: int
    step: float

    @functools.cached_property
    def time(self) -> np.ndarray:
        """Time of every row [s]."""
        return np.arange(self.steps // self.every + 1) * self.every * self.step


class Recorder:
    """What a batch keeps: some signals row by row, and reductions of some signals.

    Parameters
    ----------
    signals : list of str
        All signals of the program.
    log : list of str
        Labels to keep.
    reduce : dict
        Reduction by name.
    schedule : Schedule
        When rows come.
    runs : int
        Number of runs.
    owner : str
        Name of the diagram, for messages.

    """

    def __init__(self, signals: Sequence[str], log: list[str], reduce: Mapping[str, Reduction],
                 schedule: Schedule, runs: int, owner: str) -> None:
        self.time, self.log, self.reduce = schedule.time, log, reduce
        self.entries = list(log)
        self._parts: dict[str, tuple[list[int], list[int], bool]] = {}
        for name, one in reduce.items():
            if not isinstance(one, Reduction):
                raise ClieError(f"reduction {name!r} must come from clie_blocks.compiled.reduce, "
                                f"such as reduce.mean('q') or reduce.fold('q', function), "
                                f"got {one!r}")
        self._windows = {name: self._window(name, schedule.step) for name in reduce}
        for name, one in reduce.items():
            plus = self._columns(select(signals, one.signal, owner))
            minus = self._columns(select(signals, one.minus, owner) if one.minus else [])
            if minus and len(minus) != len(plus):
                raise ClieError(f"reduction {name!r}: {one.signal!r} has {len(plus)} signals and "
                                f"{one.minus!r} has {len(minus)}")
            self._parts[name] = plus, minus, one.signal in signals
        room = 8 * runs * len(log) * self.time.size
        if room > ROOM:
            raise ClieError(f"{owner}: the rows of {runs} runs would take {room / 1e9:.0f} GB; "
                            "keep fewer with log= or every=, or use reduce=")
        self.outputs = np.empty((runs, len(log), self.time.size))

    def keep(self, runs: slice, first: int, values: np.ndarray, states: dict[str, Any]) -> None:
        """Take rows of some runs, from row `first` on.

        `values` has the shape (rows, entries, width), with lanes behind the last run ignored;
        `states` is what the reductions of these runs remember, changed in place.
        """
        rows = slice(first, first + len(values))
        logged = values[:, :len(self.log), :runs.stop - runs.start]
        self.outputs[runs, :, rows] = logged.transpose(2, 1, 0)
        for name, one in self.reduce.items():
            low, high = np.clip(np.array(self._windows[name]) - first, 0, len(values))
            if low < high:
                plus, minus, _ = self._parts[name]
                part = values[low:high, plus]
                states[name] = one.fold(states.get(name), self.time[rows][low:high],
                                        part - values[low:high, minus] if minus else part)

    def result(self, name: str, states: Mapping[str, Any], width: int) -> np.ndarray:
        """Return a reduction of runs side by side, runs first, of what it remembers."""
        values = np.asarray(self.reduce[name].finish(states[name]))
        if values.shape[-1:] != (width,):
            raise ClieError(f"reduction {name!r} gives the shape {values.shape}; its last axis "
                            f"must be the {width} runs side by side")
        values = np.moveaxis(values, -1, 0)
        is_label = self._parts[name][2]
        return values[:, 0] if is_label and values.shape[1:] == (1,) else values

    def _columns(self, labels: list[str]) -> list[int]:
        self.entries += [label for label in labels if label not in self.entries]
        return [self.entries.index(label) for label in labels]

    def _window(self, name: str, step: float) -> np.ndarray:
        one, slack = self.reduce[name], 1e-6 * step
        window = np.searchsorted(self.time, [one.start - slack, one.end + slack])
        if window[0] >= window[1]:
            raise ClieError(f"reduction {name!r}: no row lies between {one.start:g} s and "
                            f"{one.end:g} s; rows come every "
                            f"{self.time[-1] / max(1, self.time.size - 1):g} s up to "
                            f"{self.time[-1]:g} s")
        return window
