"""``clie real``: the diagnosis on real machines whose truth is known independently."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from clie_blocks.analysis.real.page import save_page, terminal_lines
from clie_blocks.analysis.real.truth import Machine, Run, machines_of
from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, progress, report_stage, run_main, to_json, write


def main(argv: list[str] | None = None) -> int:
    """Score every run; the exit code is 1 if an effect is attributed that is not there."""
    args = _parser().parse_args(argv)
    machines = machines_of(args.folder)
    runs = [(machine, run) for machine in machines for run in machine.runs
            if not args.only or any(part in f"{machine.name} {run.name}" for part in args.only)]
    if not runs:
        raise ClieError(f"--only {' '.join(args.only)}: no run has this in the name of its "
                        f"machine or its own; there are {', '.join(m.name for m in machines)}")
    with progress("machines", len(runs)) as advance:
        rows = []
        for machine, run in runs:
            report_stage(f"{machine.name}: {run.name}")
            rows.append(scored(machine, run, args.seconds))
            advance(1)
    board = scoreboard(rows)
    text = to_json(board)
    if args.output:
        write(Path(args.output) / "real.json", text)
        print(f"page: {save_page(board, Path(args.output))}", file=sys.stderr)
    print(text if args.json else "\n".join(terminal_lines(board)))
    return int(any(row["false"] for row in rows))


def scored(machine: Machine, run: Run, seconds: float) -> dict[str, Any]:
    """One row of the scoreboard: truth, answer, and how they compare."""
    from clie_blocks.analysis.real.outcome import outcome_of
    from clie_blocks.analysis.real.score import score

    row: dict[str, Any] = {"machine": machine.name, "run": run.name, "source": machine.source,
                           "truth": list(run.cause), "joint": list(run.joint), "why": run.why,
                           "absent": list(run.absent), "false": [], "sizes": []}
    begin = time.monotonic()
    try:
        outcome = outcome_of(machine, run, seconds)
        found = score(run, outcome)
    except ClieError as error:
        return {**row, "error": str(error), "first": False if run.cause else None,
                "at_joint": None, "in_set": False if run.cause else None}
    effects = [{"effect": one["effect"], "probability": one["probability"],
                "joint": [outcome.joints[k - 1] for k in one["joint"] or ()]}
               for one in outcome.answer["effects"][:3]]
    return {**row, "verdict": outcome.answer["verdict"], "answer": effects,
            "set_90": outcome.answer["set_90"], "first": found.is_first,
            "at_joint": found.is_joint, "in_set": found.is_in_set, "false": list(found.false),
            "gap": {key: outcome.answer.get(f"gap_{key}") for key in ("before", "after", "floor")},
            "sizes": [{"parameter": one.size.parameter, "truth": [one.size.low, one.size.high],
                       "value": one.quantity and one.quantity.value,
                       "interval": one.quantity and [one.quantity.low, one.quantity.high],
                       "right": one.is_right} for one in found.sizes],
            "seconds": time.monotonic() - begin}


def scoreboard(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """All rows, and the shares over them."""
    from clie_blocks.analysis.real.score import rate

    return {"schema_version": 1, "first": rate(row["first"] for row in rows),
            "joint": rate(row["at_joint"] for row in rows),
            "in_set": rate(row["in_set"] for row in rows),
            "sizes": rate(one["right"] for row in rows for one in row["sizes"]),
            "false": sum(len(row["false"]) for row in rows), "runs": rows}


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie real",
        "Diagnose real machines whose truth is known independently, and score the answers.",
        output_help="folder for real.json and the page real.html",
        epilog="FOLDER holds one folder of logs per machine; the public machines are known by the "
               "name of their folder, any other has a truth.toml beside its logs "
               "(docs/real_machines.md). Exit codes: 0 ok, 1 an effect is attributed to a machine "
               "that does not have it, 2 usage, 3 bad data.")
    parser.add_argument("folder", type=Path, metavar="FOLDER",
                        help="folder with one folder of logs per machine")
    parser.add_argument("--only", nargs="+", default=[], metavar="TEXT",
                        help="runs with one of these texts in the name of the machine or the run")
    parser.add_argument("--seconds", type=float, default=120.0, metavar="S",
                        help="budget of each diagnosis")
    return parser


if __name__ == "__main__":
    run_main(main)
