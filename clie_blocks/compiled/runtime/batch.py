"""Many runs of one program: side by side in the lanes of a processor, on several of them.

Time goes forward in chunks for all runs together, so inputs are made once, and nothing longer
than a chunk is kept unless it is logged.
"""

import contextlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from clie_blocks.compiled.codegen.engine import Engine
from clie_blocks.compiled.codegen.lane_layout import Memory, lanes
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.runtime.inputs import Rows
from clie_blocks.compiled.runtime.parameter_sets import ParameterSets
from clie_blocks.compiled.runtime.recorder import Recorder, Schedule
from clie_blocks.compiled.runtime.simulate import CHUNK, patient_progress
from clie_blocks.errors import ClieError, nearest
from clie_blocks.processors import processors

BUFFER = 1 << 20  # bytes of rows in a chunk: they stay in the cache of the processor


@dataclass(frozen=True)
class Batch:
    """The runs of a batch; ``batch['name']`` is a reduction.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Time [s].
    outputs : ndarray, shape (N, signals, rows)
        What was logged.
    output_labels : list of str
        Its signals.
    final_state : ndarray, shape (N, states)
        The states at the end.
    reduced : dict
        By name, an array whose first axis is runs.

    """

    time: np.ndarray
    outputs: np.ndarray
    output_labels: list[str]
    final_state: np.ndarray
    reduced: dict[str, np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.reduced:
            raise ClieError(f"the batch has no reduction {name!r}; {nearest(name, self.reduced)}")
        return self.reduced[name]

    def __len__(self) -> int:
        return len(self.final_state)

    @property
    def diverged(self) -> np.ndarray:
        """Which runs ended with a state that is infinite or NaN, shape (N,)."""
        return ~np.all(np.isfinite(self.final_state), axis=1)


class Group:
    """Runs side by side; the last run also fills lanes that would stay empty.

    Parameters
    ----------
    sets : ParameterSets
        All runs.
    memory : Memory
        What differs between lanes.
    first : int
        The first run of the group.
    entries : int
        Entries of the record.

    """

    def __init__(self, sets: ParameterSets, memory: Memory, first: int, entries: int) -> None:
        self.runs = slice(first, min(first + memory.width, len(sets)))
        lane = np.minimum(first + np.arange(memory.width), len(sets) - 1)
        self.p = memory.pack("p", sets.p[lane].T)
        self.x = memory.pack("x", sets.x[lane].T)
        self.width = memory.width
        self.remembered: dict[str, Any] = {}  # state of every reduction
        self.slots = np.arange(memory.size("record", entries))

    def advance(self, engine: Engine, schedule: Schedule, first: int, inputs: np.ndarray,
                recorder: Recorder) -> None:
        """Take the steps of one chunk."""
        begin = -(-first // schedule.every)
        rows = -(-(first + len(inputs)) // schedule.every) - begin
        self._keep(recorder, begin, self._run(engine, schedule, first, self.x, inputs, rows))

    def end(self, engine: Engine, schedule: Schedule, inputs: np.ndarray,
            recorder: Recorder) -> None:
        """Take the row at the end: the first row of one step more, taken on a copy."""
        rows = self._run(engine, schedule, schedule.steps, self.x.copy(), inputs, 1)
        self._keep(recorder, schedule.steps // schedule.every, rows)

    def _run(self, engine: Engine, schedule: Schedule, first: int, x: np.ndarray,
             inputs: np.ndarray, rows: int) -> np.ndarray:
        values = np.empty((rows, self.slots.size))
        engine.run(len(inputs), schedule.step, 0.0, first, x, inputs, self.p, schedule.every,
                   self.slots, values)
        return values

    def final_state(self) -> np.ndarray:
        """Return the states, runs first."""
        return self.x.reshape(-1, self.width).T[:self.runs.stop - self.runs.start]

    def results(self, recorder: Recorder) -> dict[str, np.ndarray]:
        """Return every reduction, runs first."""
        count = self.runs.stop - self.runs.start
        return {name: recorder.result(name, self.remembered, self.width)[:count]
                for name in recorder.reduce}

    def _keep(self, recorder: Recorder, first: int, values: np.ndarray) -> None:
        with np.errstate(all="ignore"):  # a run that has diverged goes on as NaN
            shaped = values.reshape(len(values), len(recorder.entries), self.width)
            recorder.keep(self.runs, first, shaped, self.remembered)


def run_batch(build: Callable[[Layout, Memory], Engine], arranged: Layout, schedule: Schedule,
              sets: ParameterSets, rows: Rows, recorder: Recorder, width: int, threads: int,
              label: str) -> Batch:
    """Run all parameter sets on the same inputs, `width` side by side in each thread."""
    recorded, memory = lanes_of_runs(arranged, recorder.entries, width, sets.own)
    engine = build(recorded, memory)
    groups = [Group(sets, memory, first, len(recorded.record))
              for first in range(0, len(sets), width)]
    _advance_all(engine, schedule, groups, rows, recorder, threads, label)
    reduced = [group.results(recorder) for group in groups]
    return Batch(schedule.time, recorder.outputs, recorder.log,
                 np.concatenate([group.final_state() for group in groups]),
                 {name: np.concatenate([each[name] for each in reduced])
                  for name in recorder.reduce})


def lanes_of_runs(arranged: Layout, entries: Sequence[str], width: int, own: np.ndarray,
                  ) -> tuple[Layout, Memory]:
    """Return the layout that records some signals, and the memory of runs with own parameters."""
    record = [arranged.record[arranged.slots[name]] for name in entries]
    return (replace(arranged, record=record, slots={}),
            lanes(width, arranged.nx, len(record), own))


def lanes_and_threads(runs: int, threads: int | None, widest: int) -> tuple[int, int]:
    """Return how many runs go side by side and in how many threads.

    Raises
    ------
    ClieError
        If the number of threads makes no sense.

    """
    if threads is None:
        threads = processors()
    if not (isinstance(threads, (int, np.integer)) and threads >= 1):
        raise ClieError(f"threads must be a whole number >= 1, got {threads!r}")
    width = min(widest, 1 << (-(-runs // threads) - 1).bit_length())
    return width, min(threads, -(-runs // width))


def _advance_all(engine: Engine, schedule: Schedule, groups: list[Group], rows: Rows,
                 recorder: Recorder, threads: int, label: str) -> None:
    room = 8 * max(1, groups[0].width * len(recorder.entries))
    chunk = min(CHUNK, max(1, BUFFER // room) * schedule.every)
    with contextlib.ExitStack() as stack:
        side_by_side = (map if threads == 1
                        else stack.enter_context(ThreadPoolExecutor(threads)).map)
        progress = patient_progress(stack, label, schedule.steps)
        for first in range(0, schedule.steps, chunk):
            inputs = np.ascontiguousarray(rows(min(chunk, schedule.steps - first)))
            advance = partial(Group.advance, engine=engine, schedule=schedule, first=first,
                              inputs=inputs, recorder=recorder)
            list(side_by_side(advance, groups))
            progress(first + len(inputs))
    if schedule.steps % schedule.every == 0:
        inputs = np.ascontiguousarray(rows(1))
        for group in groups:
            group.end(engine, schedule, inputs, recorder)
