"""Which logs are held out for validation."""

from __future__ import annotations

from collections.abc import Sequence

from clie_blocks.analysis.gap.problem.locked_output import is_locked
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records import Record, Robot


def held_out_logs(records: Sequence[Record], held_out: Sequence[int] | None) -> tuple[int, ...]:
    """Numbers of the logs held out: as stated, or the last of several."""
    if held_out is not None:
        return tuple(held_out)
    return (len(records) - 1,) if len(records) > 1 else ()


def held_out_of_free(robot: Robot, records: Sequence[Record], held_out: Sequence[int] | None,
                     ) -> Sequence[int] | None:
    """Hold-out logs counted among those whose output was free; None for the last of these."""
    if not held_out:
        return held_out
    free = [k for k, record in enumerate(records) if not is_locked(record, robot)]
    return [free.index(k) for k in held_out if k in free] or None


def split_logs(by_record: Sequence[Sequence[Log]], held_out: Sequence[int],
               ) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Logs to fit and logs held out; the pieces of a record stay together."""
    return (tuple(log for k, pieces in enumerate(by_record) if k not in held_out
                  for log in pieces),
            tuple(log for k in held_out for log in by_record[k]))
