"""Two encoders per joint: every run is seen twice, and models predict what both see.

A log whose other encoder was logged is followed by a second view of the same run: a `Log` with the
positions of that encoder.  The loop is the same in both, so reference, excitation, start and the
noise that goes round it are those of the law's encoder.  The zero of the other encoder is its own.
"""

import dataclasses
from collections.abc import Iterator, Sequence

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem


def with_both_views(problem: Problem) -> Problem:
    """Problem in which models predict both encoders; itself where no log has two."""
    if all(log.other_q is None for log in problem.logs):
        return problem
    return dataclasses.replace(problem, fit=tuple(_both(problem.fit)),
                               held_out=tuple(_both(problem.held_out)), two_encoders=True)


def _both(logs: Sequence[Log]) -> Iterator[Log]:
    for log in logs:
        yield log
        if log.other_q is not None:
            level = log.q.mean(axis=0) - log.other_q.mean(axis=0)
            yield dataclasses.replace(log, q=log.other_q + level, other_q=log.q,
                                      of_other_encoder=True)


def views_of_law(problem: Problem) -> Problem:
    """Problem with what the law's encoder saw alone, in models of both encoders."""
    return problem if not problem.two_encoders else dataclasses.replace(
        problem, fit=tuple(log for log in problem.fit if not log.of_other_encoder),
        held_out=tuple(log for log in problem.held_out if not log.of_other_encoder))
