"""Threads and processes: as many as there are processors, and the same numbers from each."""

import os
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.workers import workers
from clie_blocks.processors import LIMIT, processors, side_by_side


@given(st.lists(st.integers()), st.integers(1, 4))
def test_results_come_in_the_order_of_the_items(items, threads):
    assert side_by_side(lambda x: 2 * x, items, threads) == [2 * x for x in items]


def test_two_items_are_worked_on_at_a_time():
    both = threading.Barrier(2, timeout=30)
    assert side_by_side(lambda _: both.wait() in (0, 1), range(2), 2) == [True, True]


def test_a_failure_in_a_thread_is_that_of_the_call():
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda x: 1 / x, [1, 0], 2)


@pytest.mark.parametrize(("limit", "expected"), [
    ("1", 1), ("100000", None), ("", None), ("0", None), ("two", None)])
def test_the_environment_limits_the_processors(monkeypatch, limit, expected):
    monkeypatch.delenv(LIMIT, raising=False)
    every = processors()
    assert 1 <= every <= os.cpu_count()
    monkeypatch.setenv(LIMIT, limit)
    assert processors() == (expected or every)


def test_processes_share_the_processors(monkeypatch):
    monkeypatch.setattr("clie_blocks.analysis.workers.processors", lambda: 6)
    for jobs, threads in ((1, "6"), (4, "1")):
        with workers(jobs) as pool:
            assert pool.submit(os.getenv, LIMIT).result() == threads
