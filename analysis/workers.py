"""Processes that work side by side, and end with the one that started them."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process


def workers(jobs: int) -> ProcessPoolExecutor:
    """Pool of so many fresh processes, which share no state with this one."""
    return ProcessPoolExecutor(jobs, mp_context=get_context("spawn"),
                               initializer=end_with_parent)


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
