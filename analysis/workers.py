"""Processes that work side by side, and end with the one that started them."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process


def workers(jobs):
    """Return a pool of processes that begin afresh.

    Parameters
    ----------
    jobs : int
        How many.

    """
    return ProcessPoolExecutor(jobs, mp_context=get_context("spawn"),
                               initializer=end_with_parent)


def end_with_parent():
    """Make a worker process end, without a word, when its parent is killed or interrupted."""
    import signal
    import threading

    def wait():
        parent_process().join()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=wait, daemon=True).start()
