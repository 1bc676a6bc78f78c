"""Runs that are killed, and clusters that do not answer: no orphans, no tracebacks."""

import signal
import subprocess
import sys
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from types import ModuleType

import pytest

from clie_blocks.analysis.gap import batch
from clie_blocks.errors import ClieError, MissingExtraError

KILLED = """
import os, signal, time
from clie_blocks.analysis.workers import workers

if __name__ == "__main__":
    pool = workers(1)
    pool.submit(os.getpid).result()
    pool.submit(time.sleep, 600)
    print("working", flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_worker_ends_with_its_parent(tmp_path):
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    run = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE,
                           stderr=subprocess.DEVNULL, text=True)
    output, _ = run.communicate(timeout=60)  # ends when the worker, too, has closed the pipe
    assert run.returncode == -signal.SIGKILL and output == "working\n"


class Broken(Executor):
    """Processes of which one was killed."""

    def submit(self, *args):
        """Return what a broken pool returns."""
        future = Future()
        future.set_exception(BrokenProcessPool())
        return future


def test_a_killed_worker_is_reported_with_the_remedy():
    waiting = [batch.Task("one", ("nowhere",))]
    with pytest.raises(ClieError, match="killed.*run the same command again"):
        list(batch.diagnose_all(waiting, jobs=2, executor=Broken()))


def test_a_missing_or_silent_cluster_is_reported_with_the_remedy(monkeypatch):
    def silent(address):
        raise OSError("Timed out")

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match="cluster"), batch.cluster("tcp://here:1"):
        pass
    distributed = ModuleType("distributed")
    distributed.Client = silent
    monkeypatch.setitem(sys.modules, "distributed", distributed)
    with pytest.raises(ClieError, match="no Dask scheduler answers at tcp://here:1"), \
            batch.cluster("tcp://here:1"):
        pass
