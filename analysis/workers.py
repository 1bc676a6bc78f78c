"""Processes that work side by side, and end with the one that started them."""

import contextlib
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess

from clie_blocks.processors import LIMIT, processors

SAFE_PATH = {"PYTHONSAFEPATH": "1"}  # no module comes from the current folder, a folder of data


def workers(jobs: int) -> ProcessPoolExecutor:
    """Pool of so many fresh processes, which share no state with this one, but its processors."""
    threads = max(processors() // jobs, 1)
    with _safe_path():  # the tracker of its locks is a process too
        return ProcessPoolExecutor(jobs, mp_context=_SafeContext(), initializer=_begin,
                                   initargs=(threads,))


def _begin(threads: int) -> None:
    os.environ[LIMIT] = str(threads)
    end_with_parent()


class _SafeProcess(SpawnProcess):
    """A process whose interpreter does not import what lies in the current folder."""

    def start(self) -> None:
        with _safe_path():
            super().start()


class _SafeContext(SpawnContext):
    Process = _SafeProcess


@contextlib.contextmanager
def _safe_path() -> Iterator[None]:
    """Set what an interpreter reads when it starts; other children of this process keep theirs."""
    before = {name: os.environ.get(name) for name in SAFE_PATH}
    os.environ.update(SAFE_PATH)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def end_with_parent() -> None:
    """Make a worker process end silently when its parent is killed or interrupted."""
    import signal
    import threading

    parent = parent_process()
    if parent is None:
        return  # not a worker

    def wait() -> None:
        parent.join()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=wait, daemon=True).start()
