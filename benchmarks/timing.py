"""Medians of repeats taken in turn, so that a busy machine slows all of them alike."""

import statistics
import time


def seconds(job, clock=time.process_time):
    """Return how long a job takes, by default in time of the processor alone."""
    start = clock()
    job()
    return clock() - start


def interleaved(jobs, repeats, clock=time.process_time):
    """Return the times of several jobs, by name, taken in turn."""
    times = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            times[name].append(seconds(job, clock))
    return times


def ratio(times, name, other):
    """Return the median of the ratios of neighbouring times, and the least and the greatest."""
    ratios = [one / two for one, two in zip(times[name], times[other])]
    return statistics.median(ratios), min(ratios), max(ratios)


def markdown(header, rows):
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
