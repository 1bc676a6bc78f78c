"""``clie export``: the correction of an answer, put into the simulator that the user has."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, progress, run_main, to_json, wrapped


def main(argv: list[str] | None = None) -> int:
    """Run the command."""
    args = _parser().parse_args(argv)
    from clie_blocks.analysis.export.correction import read_correction
    from clie_blocks.analysis.export.export import export

    if not args.output:
        raise ClieError("an export writes files: name a folder for them with -o DIR")
    correction, renamed = read_correction(args.answer), _renamed(args.joint)
    found = export(correction, args.to, args.model, renamed, args.step)
    if args.samples is not None:
        from clie_blocks.analysis.export.samples import draw, with_samples

        with progress(f"drawing {args.samples} samples"):
            found = with_samples(found, correction, draw(correction, args.samples, args.seed),
                                 args.model, renamed, args.step)
    paths = found.save(args.output)
    if args.json:
        print(to_json({"schema_version": 1, "target": found.target, "files": paths,
                       "notes": found.notes, "diff": found.diff, "ran": found.ran}))
        return 0
    if found.diff:
        print(found.diff, end="")
    for note in found.notes:
        print(wrapped(f"note: {note}"), file=sys.stderr)
    for path in paths:
        if "samples" not in path.parts:
            print(f"wrote {path}", file=sys.stderr)
    if args.samples is not None and args.to == "mujoco":
        print(f"wrote {Path(args.output) / 'samples'}: {args.samples} models", file=sys.stderr)
    print(found.ran, file=sys.stderr)
    return 0


def _renamed(pairs: list[str]) -> dict[str, str]:
    """Names of joints in the model, by their names in the logs."""
    renamed = {}
    for pair in pairs:
        logged, equals, name = pair.partition("=")
        if not (logged and equals and name):
            raise ClieError(f"--joint {pair}: write NAME_IN_LOG=NAME_IN_MODEL, such as "
                            "--joint axis=slider_1")
        renamed[logged] = name
    return renamed


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie export",
        "Put the correction of a diagnosis into a simulator: your own model, patched, or code "
        "that it calls.",
        output_help="folder for the files; needed",
        epilog="The diff of your model goes to stdout; your file is not touched. 'clie replay' "
               "then runs the corrected model against a log. "
               "Exit codes: 0 exported, 2 usage, 3 bad data.")
    parser.add_argument("answer", type=Path, metavar="ANSWER.json",
                        help="answer of one robot, as 'clie diagnose -o DIR' writes it")
    parser.add_argument("--to", required=True, metavar="TARGET",
                        help="mujoco, gazebo, ros2-control, isaac, newton, c, fmu, "
                             "python-control, drake, simulink, simscape or modelica")
    parser.add_argument("--model", type=Path, metavar="FILE",
                        help="your own model of the robot, to be patched: an MJCF for mujoco, an "
                             "SDF for gazebo; without it mujoco gets one of the stated links")
    parser.add_argument("--joint", action="append", default=[], metavar="LOG=MODEL",
                        help="name of a joint in the logs, and in the model; repeat it")
    parser.add_argument("--step", type=float, metavar="S",
                        help="step of your simulator [s], which for mujoco stands in the model; "
                             "else for gazebo that of the world or 1 ms, for ros2-control, isaac "
                             "and newton the controller's period, and 0.125 ms or the largest "
                             "fraction of that period below")
    parser.add_argument("--samples", type=int, metavar="N",
                        help="draw N corrections within what the logs leave uncertain: "
                             "samples.json, with ranges and correlations, for mujoco a model "
                             "each, and for isaac an event term that draws them")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers of --samples")
    return parser


if __name__ == "__main__":
    run_main(main)
