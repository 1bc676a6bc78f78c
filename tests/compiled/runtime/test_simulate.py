import contextlib
import threading
import tracemalloc

import numpy as np

from clie_blocks.compiled import compile_diagram, held_normal
from clie_blocks.compiled.runtime import simulate

DRIVE = {"q_d": held_normal(1.0, 0)}


def test_memory_of_a_long_run_stays_bounded(loop):
    program = compile_diagram(loop)
    program.run(0.1, inputs=DRIVE)
    tracemalloc.start()
    run = program.run(100.0, inputs=DRIVE, every=10_000)  # a million steps
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert run.outputs.shape == (4, 101)
    assert peak < 5e6  # the noise alone would fill 16e6 bytes at once


def test_long_runs_report_their_progress(loop, monkeypatch):
    reported, labels = [], []

    @contextlib.contextmanager
    def recorder(label, total):
        labels.append((label, total))
        yield reported.append

    monkeypatch.setattr(simulate, "progress", recorder)
    program = compile_diagram(loop)
    program.run(10.0, inputs=DRIVE, every=1000)
    assert labels == []
    monkeypatch.setattr(simulate, "PATIENCE", -1.0)
    program.run(10.0, inputs=DRIVE, every=1000)
    assert labels == [("running loop", 100_000)]
    assert sum(reported) == 100_000 and len(reported) > 3


def test_programs_in_two_threads_do_not_disturb_each_other(loop):
    program = compile_diagram(loop)
    gains = [1.0, 3.0, 5.0, 7.0]

    def run(gain):
        return program.run(5.0, inputs=DRIVE, params={"pd.gain": gain}, every=500).outputs

    alone, together = [run(gain) for gain in gains], {}
    threads = [threading.Thread(target=lambda gain=gain: together.update({gain: run(gain)}))
               for gain in gains]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for gain, expected in zip(gains, alone):
        np.testing.assert_array_equal(together[gain], expected)
