"""Processors that this process may use, and work that is spread over them."""

import os
from collections.abc import Callable, Iterable
from typing import TypeVar

LIMIT = "OMP_NUM_THREADS"
"""Variable of the environment with the most threads of a process, as numerical libraries read it.

Set it where several processes share a computer; `clie_blocks.analysis.workers` does.
"""
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def processors() -> int:
    """Return how many processors this process may use, in a container too."""
    allowed = (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity")
               else os.cpu_count() or 1)
    limit = os.environ.get(LIMIT, "")
    return min(allowed, int(limit)) if limit.isdecimal() and int(limit) else allowed


def side_by_side(function: Callable[[_Item], _Result], items: Iterable[_Item],
                 threads: int | None = None) -> list[_Result]:
    """Return the results of a function for some items, of which several are worked on at a time.

    It pays for machine code, which runs without the lock of the interpreter.

    Parameters
    ----------
    function : callable
        May run in several threads.
    items : iterable
        Arguments, one per result.
    threads : int, optional
        The most threads; by default one per processor.

    """
    waiting = list(items)
    threads = min(processors() if threads is None else threads, len(waiting))
    if threads <= 1:
        return list(map(function, waiting))
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, waiting))
