"""``clie diagnose``: where a model is wrong, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from clie_blocks.analysis.records.reading import add_reading_options, reading
from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, json_types, run_main, to_json, wrapped, write

ALL = "answers.json"  # all answers by name, in the folder of the results
OVERVIEW = "answers.html"  # the same as a page that leads to the reports
FLEET = "fleet"  # comparison of the units of one robot, as a page and as JSON


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 0 if every robot was diagnosed, else the code of the first error."""
    parser = _parser()
    args = parser.parse_args(argv)
    if args.compare:
        return _compare(args)
    if args.model:
        return _suspect(args)
    if not args.paths:
        parser.error("name a folder with robot.toml and logs, or logs; or --compare LOADED "
                     "UNLOADED")
    from clie_blocks.analysis.gap import batch

    tasks = batch.find_tasks(args.paths, args.robot)
    options = batch.Options(args.holdout, _names(args.effects), _names(args.exclude),
                            simulated=tuple(map(str, args.simulated)), reading=reading(args),
                            trust_logs=args.trust_log, seconds=args.seconds,
                            library=tuple(map(str, args.library)), run_law=args.run_law,
                            by_log=args.fleet)
    if args.simulated and len(tasks) > 1:
        raise ClieError(f"--simulated is for the logs of one robot, and there are {len(tasks)}: "
                        "name one folder")
    if args.fleet and len(tasks) == 1:
        raise ClieError("--fleet compares units of one robot, and there is one: name a folder "
                        "with a folder of logs for each unit")
    answers = dict(sorted(_diagnose(tasks, options, args).items()))
    content = to_json(answers if len(tasks) > 1 else next(iter(answers.values())))
    if args.output and len(tasks) > 1:
        write(Path(args.output) / ALL, content)
        _write_overview(answers, Path(args.output))
    if args.json:
        print(content)
    if args.fleet:
        _compare_units(answers, args)
    failed = [answer for answer in answers.values() if "error" in answer]
    for answer in failed:
        print(f"error: {answer['error']}", file=sys.stderr)
    return failed[0]["exit_code"] if failed else 0


def _diagnose(tasks: list[Any], options: Any, args: argparse.Namespace
              ) -> dict[str, dict[str, Any]]:
    """Answers by name; each verdict is printed when it is there, next to JSON on stderr."""
    from clie_blocks.analysis.gap import batch
    from clie_blocks.analysis.gap.report.summary import terminal_lines

    answers = {}
    with batch.cluster(args.cluster) if args.cluster else nullcontext() as executor:
        for name, answer in batch.diagnose_all(tasks, options, args.jobs, args.output, executor):
            answers[name] = answer
            if not args.quiet:
                print(terminal_lines(name, answer), flush=True,
                      file=sys.stderr if args.json else sys.stdout)
            if args.output and "error" not in answer and answer["verdict"] != "locked":
                print(f"report: {Path(args.output) / name}.html", flush=True, file=sys.stderr)
    return answers


def _compare(args: argparse.Namespace) -> int:
    """Print the load between two sets of logs of one robot."""
    from clie_blocks.analysis.gap.batch import Options
    from clie_blocks.analysis.gap.load_comparison.command import compare_paths

    if args.paths:
        raise ClieError(f"--compare is of the two sets of logs that follow it, and "
                        f"{args.paths[0]} is a third: leave it out, or diagnose it apart")
    options = Options(trust_logs=args.trust_log, run_law=args.run_law, reading=reading(args))
    loaded, unloaded = args.compare
    answer = compare_paths(loaded, unloaded, args.robot, options)
    if args.output:
        write(Path(args.output) / "load.json", to_json(answer.to_dict()))
    print(to_json(answer.to_dict()) if args.json else answer)
    return 0


def _suspect(args: argparse.Namespace) -> int:
    """Print what a simulator does wrong, by its own logs and its model file."""
    from clie_blocks.analysis.gap.simulator_faults.command import lines, suspect_paths
    from clie_blocks.output import progress

    if args.paths or not args.simulated:
        raise ClieError("--model is the file of the simulator that made the logs behind "
                        "--simulated, without logs of a robot; to compare the two, leave it out")
    with progress("examining the simulator"):
        found = suspect_paths(args.simulated, args.model, args.robot, reading(args))
    answer = json_types(found.to_dict())
    if args.output:
        write(Path(args.output) / "simulator.json", to_json(answer))
    print(to_json(answer) if args.json else "\n".join(lines(answer)))
    return 0


def _write_overview(answers: dict[str, dict[str, Any]], folder: Path) -> None:
    from clie_blocks.analysis.gap.report.overview import overview
    from clie_blocks.analysis.report.render import html

    page = write(folder / OVERVIEW, html(overview(answers), {}))
    print(f"all robots: {page}", file=sys.stderr)


def _compare_units(answers: dict[str, dict[str, Any]], args: argparse.Namespace) -> None:
    """Print what units of one robot share, and which one is odd; with a folder, as a page, too."""
    from clie_blocks.analysis.gap.fleet.comparison import compare_units

    fleet = compare_units(answers)
    print("\n".join(map(wrapped, str(fleet).splitlines())),
          file=sys.stderr if args.json else sys.stdout)
    if args.output:
        from clie_blocks.analysis.gap.fleet.page import page
        from clie_blocks.analysis.report.render import drawings, html

        write(Path(args.output) / f"{FLEET}.json", to_json(fleet.to_dict()))
        document = page(fleet)
        file = write(Path(args.output) / f"{FLEET}.html", html(document, drawings(document)))
        print(f"fleet: {file}", file=sys.stderr)


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip()) if text else ()


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes, 1 or more")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie diagnose",
        "Say where a model is wrong, which effect causes it, and how far the gap shrinks.",
        output_help="folder for the reports and results; the same command continues there after "
                    "an interruption; results of several robots also as answers.json, by name",
        epilog="Exit codes: 0 diagnosed, 2 usage, 3 bad data, 4 not identifiable, 5 diverged. "
               "With --json, data goes to stdout (one robot: its answer; several: by name) and "
               "verdicts go to stderr.")
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH",
                        help="folder with robot.toml and logs, folder of such folders, or logs of "
                             "one robot")
    parser.add_argument("--robot", metavar="FILE", type=Path,
                        help="robot.toml of the logs; else the one beside them")
    parser.add_argument("--holdout", metavar="LOG",
                        help="hold-out log, used for validation only, by name or number; the last "
                             "by default")
    parser.add_argument("--effects", metavar="NAMES",
                        help="search for these effects only, separated by commas")
    parser.add_argument("--exclude", metavar="NAMES", help="do not search for these effects")
    parser.add_argument("--library", type=Path, nargs="+", metavar="FILE", default=[],
                        help="Python files with effects of your own, which are run and searched "
                             "for with those of the catalogue")
    parser.add_argument("--run-law", action="store_true",
                        help="run the control law that robot.toml names as FILE.py:NAME or "
                             "FILE.c:NAME: a program, which you have read")
    parser.add_argument("--simulated", type=Path, nargs="+", metavar="LOG", default=[],
                        help="logs of your own simulator in the same experiments: find what it is "
                             "missing")
    parser.add_argument("--model", type=Path, metavar="FILE",
                        help="MJCF that the simulator of --simulated was to run, without logs of "
                             "a robot: find what the simulator does wrong")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("LOADED", "UNLOADED"),
                        help="folders or logs of one robot in one motion, with and without a "
                             "load: how heavy it is, and where it sits")
    parser.add_argument("--fleet", action="store_true",
                        help="the robots are units of one type: also say what they have in "
                             "common, what differs by unit and by log, and which unit is odd")
    add_reading_options(parser)
    parser.add_argument("--trust-log", action="store_true",
                        help="take the logs as they are: correct nothing, stop for nothing that "
                             "'clie check' finds")
    parser.add_argument("--seconds", type=_seconds, default=120.0, metavar="S",
                        help="budget per robot: the search ends early enough to answer within it")
    parser.add_argument("--jobs", type=_count, default=1, metavar="N",
                        help="robots diagnosed in parallel; they share the processors, of which "
                             "a single robot gets all, or as many as OMP_NUM_THREADS allows")
    parser.add_argument("--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster")
    parser.add_argument("--quiet", action="store_true", help="print no verdicts")
    return parser


def _seconds(text: str) -> float:
    value = float(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is no time to search in; allow 5 s or more")
    return value


if __name__ == "__main__":
    run_main(main)
