"""Medians of repeats taken in turn, so that a busy machine slows all of them alike."""

import argparse
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from clie_blocks.output import write

Job = Callable[[], Any]
Clock = Callable[[], float]
Name = TypeVar("Name")


def seconds(job: Job, clock: Clock = time.process_time) -> float:
    """Return how long a job takes, by default in time of the processor alone."""
    start = clock()
    job()
    return clock() - start


def interleaved(jobs: Mapping[Name, Job], repeats: int,
                clock: Clock = time.process_time) -> dict[Name, list[float]]:
    """Return the times of several jobs, by name, taken in turn."""
    times: dict[Name, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            times[name].append(seconds(job, clock))
    return times


def ratio(times: Mapping[str, list[float]], name: str, other: str) -> tuple[float, float, float]:
    """Return the median of the ratios of neighbouring times, and the least and the greatest."""
    ratios = [one / two for one, two in zip(times[name], times[other])]
    return statistics.median(ratios), min(ratios), max(ratios)


def markdown(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def write_page(description: str, name: str, document: Callable[[], str],
               argv: Sequence[str] | None = None) -> None:
    """Write a page of docs, or the file that the command line names, and print it."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("-o", "--output", default=Path(__file__).parents[1] / "docs" / name,
                        help="the page to write")
    options = parser.parse_args(argv)
    page = document()
    write(options.output, page)
    print(page)
