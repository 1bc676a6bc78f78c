"""``clie replay``: the corrected model in its simulator, against the log of the robot."""

from __future__ import annotations

import argparse
from pathlib import Path

from clie_blocks.analysis.records.reading import add_reading_options, reading
from clie_blocks.errors import ClieError
from clie_blocks.output import (
    command_parser,
    counted,
    print_table,
    progress,
    run_main,
    to_json,
    wrapped,
    write,
)


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 1 where the correction widens the gap of a joint."""
    args = _parser().parse_args(argv)
    from clie_blocks.analysis.export.replay import replay
    from clie_blocks.analysis.gap import batch

    tasks = batch.find_tasks(args.paths, args.robot)
    if len(tasks) != 1:
        raise ClieError(f"a replay is of one robot, and there are {len(tasks)}: name one folder")
    problem = batch.state(tasks[0], batch.Options(reading=reading(args), run_law=args.run_law))
    with progress(f"replaying {len(problem.law_logs)} logs in MuJoCo"):
        found = replay(problem, args.model, args.nominal)
    gaps = found.gaps
    content = to_json({"schema_version": 1, "model": str(args.model),
                       "nominal": str(args.nominal) if args.nominal else "robot file",
                       "logs": [log.name for log in problem.law_logs],
                       "joints": [{**vars(one), "closed_percent": one.closed} for one in gaps],
                       "set_in": [vars(one) for one in found.set_in],
                       "begins": [vars(one) for one in found.begins]})
    if args.output:
        write(Path(args.output) / "replay.json", content)
    if args.json:
        print(content)
    else:
        print(wrapped(f"{args.model} under the law of the robot file, RMS position error over "
                      f"{counted(len(problem.law_logs), 'log')}"))
        print_table(("joint", "nominal", "corrected", "noise floor", "unit", "closed"), [
            (one.joint, f"{one.nominal:.3g}", f"{one.corrected:.3g}", f"{one.floor:.3g}",
             one.unit, f"{one.closed:.0f} %") for one in gaps])
        for one in (*found.set_in, *found.begins):
            print(wrapped(f"{one}."))
    return int(any(one.corrected > max(one.nominal, one.floor) for one in gaps))


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie replay",
        "Run the stated control law on a MuJoCo model in the experiments of logs, and compare.",
        output_help="folder for replay.json",
        epilog="All simulations run without noise. The noise floor is what a right model leaves: "
               "the noise of the encoders, and the motion that it makes in the loop of the "
               "corrected model. Exit codes: 0 replayed, 1 the correction widens the gap of a "
               "joint, 2 usage, 3 bad data, 5 the simulation diverges. The logs should be unseen: "
               "not those that the diagnosis was fitted to.")
    parser.add_argument("paths", nargs="+", type=Path, metavar="LOG",
                        help="folder with robot.toml and logs, or logs of one robot")
    parser.add_argument("--model", required=True, type=Path, metavar="FILE",
                        help="corrected MJCF, as clie export wrote it, with the files beside it; "
                             "a corrected_joints.py there is a program, which is run")
    parser.add_argument("--nominal", type=Path, metavar="FILE",
                        help="your MJCF before the correction; else the model of the robot file")
    parser.add_argument("--robot", metavar="FILE", type=Path,
                        help="robot.toml of the logs; else the one beside them")
    parser.add_argument("--run-law", action="store_true",
                        help="run the control law that robot.toml names as FILE.py:NAME or "
                             "FILE.c:NAME: a program, which you have read")
    add_reading_options(parser)
    return parser


if __name__ == "__main__":
    run_main(main)
