"""``clie reproduce``: every number of the paper against ours, with a verdict for each."""

import argparse
import time
from collections.abc import Callable, Iterator, Sequence

from clie_blocks.analysis.report.render import save_document
from clie_blocks.analysis.reproduction import items as items_of
from clie_blocks.analysis.reproduction.document import (
    UNSPECIFIED,
    document,
    headline,
    join_numbers,
    spread_of,
)
from clie_blocks.analysis.reproduction.errata import ERRATA
from clie_blocks.analysis.reproduction.items import Item
from clie_blocks.analysis.reproduction.runs import READINGS
from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, progress, run_main, to_json, wrapped


def collect(seeds: Sequence[int],
            advance: Callable[[float], None] = lambda runs: None) -> list[Item]:
    """Compute all items; `advance` is called with the number of runs done."""
    return [*items_of.bound_items(), *items_of.figure_3_items(), *items_of.table_3_items(),
            *items_of.table_2_items(seeds, advance)]


def parser() -> argparse.ArgumentParser:
    """Command-line options."""
    options = command_parser(
        "clie reproduce", "Compare every number of the paper with ours, with a verdict for each.",
        output="out/reproduce")
    options.add_argument("--seeds", type=int, default=3, metavar="N",
                         help="noise seeds per reading")
    return options


def main(argv: list[str] | None = None) -> int:
    """Reproduce the paper's results, print a summary and write the report.

    The exit code is 0: "not reproduced" is a result, not a failure.
    """
    options, start = parser().parse_args(argv), time.perf_counter()
    if options.seeds < 1:
        raise ClieError(f"--seeds must be at least 1, got {options.seeds}")
    seeds = tuple(range(options.seeds))
    runs = sum(len(seeds) if reading.noisy else 1 for reading in READINGS) * 3
    with progress("reproducing the paper", runs) as advance:
        items = collect(seeds, advance)
    report = document(items, seeds)
    files = save_document(report, options.output, "reproduction")
    seconds = time.perf_counter() - start
    if options.json:
        print(to_json({"schema_version": 1, "items": [item.as_dict() for item in items],
                       "unspecified": UNSPECIFIED, "errata": [one.__dict__ for one in ERRATA],
                       "seeds": seeds, "seconds": seconds, "files": files}))
        return 0
    print("\n".join(map(wrapped, (report.verdict, *headline(items)))))
    print(f"{len(ERRATA)} errata, each proved; report in {files[0]} ({seconds:.0f} s)\n")
    print("\n".join(summary(items)))
    return 0


def summary(items: Sequence[Item]) -> Iterator[str]:
    """Two lines per item."""
    for item in items:
        if item.printed:
            yield f"{item.verdict:40} {item.place}: {item.name}"
            yield wrapped(f"printed {join_numbers(item.printed)}; ours {join_numbers(item.ours)}"
                          f"{spread_of(item)} [{item.reading}]", " " * 43)


if __name__ == "__main__":
    run_main(main)
