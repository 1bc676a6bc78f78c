"""``clie robot``: start a robot file from a gallery, a model, logs or nothing, and check one."""

import argparse
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.gallery import ROBOTS, gallery_files
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.analysis.records.robot_keys import SCHEMA, robot_schema
from clie_blocks.analysis.records.robot_template import (
    MARK,
    robot_text,
    robot_text_of_logs,
    robot_text_of_model,
)
from clie_blocks.errors import ClieError, nearest
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
from clie_blocks.rigid_body.dynamics import gravity_torque, mass_matrix
from clie_blocks.rigid_body.model_file import MODEL_FILES

NAME = "robot.toml"
_POSES = 200  # at random within the limits, of which the largest torque is shown
_WHOLE_TURN = np.pi
_ROUNDING = 1e-9  # N m or kg m^2: what is less comes from the arithmetic


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 0 if the robot file was written or is sound."""
    args = _parser().parse_args(argv)
    if args.schema:
        print(to_json(robot_schema()))
    elif args.gallery:
        _list_gallery(args.json)
    elif args.check is not None or (args.source is not None and args.source.suffix == ".toml"):
        _check(args.check or args.source, args.json)
    else:
        _start(args)
    return 0


def _check(path: Path, as_json: bool) -> None:
    """Say what a robot file states, and what each line that is missing would buy."""
    robot = read_robot(path)
    facts = _facts(robot)
    if as_json:
        print(to_json(facts))
    else:
        _show(robot, facts, path)


def _list_gallery(as_json: bool) -> None:
    """List the robots of the gallery, one line each."""
    if as_json:
        print(to_json({"robots": ROBOTS}))
        return
    print_table(("robot", "what it is"), list(ROBOTS.items()), "<<")
    print("Each states where its numbers come from, and leaves open what is not published.\n"
          f"Next: clie robot {next(iter(ROBOTS))} -o DIR")


def _start(args: argparse.Namespace) -> None:
    """Write a robot file, and beside it the schema by which editors complete and check it."""
    path = Path(args.output)
    path = path if path.suffix == ".toml" and not path.is_dir() else path / NAME
    folder = path.parent
    texts = _of_gallery(args.source, path.name) or {path.name: _text(args.source, folder, args)}
    for other in (folder / name for name in texts):
        if other.exists():
            raise ClieError(f"{other} is there already and is left as it is; name another folder "
                            f"with -o DIR, or check the file: clie robot --check {path}")
    for name, text in texts.items():
        write(folder / name, text)
    write(folder / SCHEMA, to_json(robot_schema()) + "\n")
    text = texts[path.name]
    marks = text.count(f"\n{MARK} ")
    if args.json:
        print(to_json({"file": str(path), "lines_for_you": marks}))
    else:
        print(wrapped(f"wrote {path}: {marks} lines that begin with '{MARK}' are for you"))
        print(f"Next: clie robot --check {shlex.quote(str(path))}")


def _of_gallery(source: Path | None, robot_file: str) -> dict[str, str]:
    """Files of a robot of the gallery; none where the source is a file or folder."""
    if source is None or source.exists() or source.suffix or source.parent != Path():
        return {}
    if source.name not in ROBOTS:
        raise ClieError(f"there is no file or folder {str(source)!r}, and no such robot in the "
                        f"gallery; {nearest(source, ROBOTS)}")
    return gallery_files(source.name, robot_file)


def _text(source: Path | None, folder: Path, args: argparse.Namespace) -> str:
    """Text of the robot file."""
    if source is None:
        return robot_text("my robot", [f"joint{k + 1}" for k in range(args.joints)])
    from clie_blocks.analysis.records.read import read_logs

    if source.suffix.lower() in MODEL_FILES:
        records = read_logs(args.logs)
        with progress("the control law of the logs"):
            return robot_text_of_model(source, folder, args.base, args.tip, records)
    records = read_logs([source, *args.logs])
    with progress("the control law of the logs"):
        return robot_text_of_logs(source.resolve().stem.partition(".")[0], records)


def _facts(robot: Robot) -> dict[str, Any]:
    """What a robot file says, and what it leaves open."""
    facts: dict[str, Any] = {"name": robot.name, "joints": list(robot.joints),
                             "open": _open(robot)}
    if robot.motor.coupling is not None:
        facts["motor_coupling"] = robot.motor.coupling.tolist()
    if robot.tree is None:
        return facts
    low = np.where(np.isfinite(robot.tree.lower), robot.tree.lower, -_WHOLE_TURN)
    high = np.where(np.isfinite(robot.tree.upper), robot.tree.upper, _WHOLE_TURN)
    q = np.random.default_rng(0).uniform(low, high, (_POSES, robot.n))
    return facts | {
        "mass": float(robot.tree.mass.sum()),
        "largest_weight": np.abs(gravity_torque(robot.tree, q)).max(axis=0).tolist(),
        "largest_inertia": np.diagonal(mass_matrix(robot.tree, q), axis1=-2, axis2=-1)
        .max(axis=0).tolist()}


def _open(robot: Robot) -> list[str]:
    """What is not stated, with what it costs."""
    lines = (*_open_of_body(robot), *_open_of_law(robot))
    return [f"{key}: {cost}" for is_open, key, cost in lines if is_open]


def _open_of_body(robot: Robot) -> Iterator[tuple[bool, str, str]]:
    """Whether a line on drives, links or encoders is missing, its key, and what that costs."""
    motor, links = robot.motor, robot.links
    yield (motor.gear_ratio is None, "[motor] gear_ratio",
           "taken as 1, so that torques count on the joint side")
    yield (motor.inertia is None, "[motor] inertia_kgm2",
           "inertia and damping are those that fit the logs, and a wrong one is not found")
    yield (motor.torque_offset_tolerance is None, "[motor] torque_offset_tolerance_nm",
           "a constant torque of any size counts as an offset of the drive")
    yield (robot.tree is None and links.mass is None, "[links]",
           "weight, coupling and payload cannot be told from other torques of the pose; name a "
           'model, model = "arm.urdf"')
    yield (links.model is not None and links.mass_tolerance is None, "[links] mass_tolerance",
           "the masses of the model count as exact, and what they are off becomes a load")
    yield (robot.encoder.resolution is None, "[encoder] resolution_rad",
           "the step of the position is the one that the logs show, if they do")


def _open_of_law(robot: Robot) -> Iterator[tuple[bool, str, str]]:
    """Whether a line on the control law is missing, its key, and what that costs."""
    law = robot.controller
    is_known = law.law != "unknown"
    yield (not is_known, "[controller] Kp, Kd",
           "the loop cannot be simulated, what drives the robot is taken from the log; where the "
           "logs show a PD law, 'clie robot LOGS' finds it, with a mark where it leaves a part of "
           "the commands")
    yield (is_known and law.sample_time is None, "[controller] sample_time_s",
           "that of the logs is taken")
    yield (law.law in ("pd", "pid", "cascade") and law.velocity_filter is None,
           "[controller] velocity_filter", "the one that fits the logged commands is taken")
    yield (is_known and law.saturation is None, "[controller] saturation_nm",
           "commands count as unlimited, so that a limit that was reached looks like another law")
    yield (is_known and law.command_resolution is None, "[controller] command_resolution_nm",
           "commands count as not rounded")


def _show(robot: Robot, facts: dict[str, Any], path: Path) -> None:
    print(wrapped(f"{robot.source}: {robot.name or 'robot'}, {counted(robot.n, 'joint')}"))
    if robot.tree is not None:
        print(f"links of {robot.links.model}: {facts['mass']:.4g} kg")
        print_table(("joint", "largest weight [N m]", "largest inertia [kg m^2]"),
                    [(name, _shown(weight), _shown(inertia)) for name, weight, inertia in
                     zip(robot.joints, facts["largest_weight"], facts["largest_inertia"])],
                    "<>>")
    for line in _coupled(robot):
        print(wrapped(line))
    for line in facts["open"]:
        print(wrapped(f"not stated: {line}"))
    print(f"Next: clie check {shlex.quote(str(path.parent))}, with the logs beside this file")


def _shown(value: float) -> str:
    return f"{0.0 if value < _ROUNDING else value:.3g}"


def _coupled(robot: Robot) -> list[str]:
    """What the motors turn, where that is not each its own joint."""
    if robot.motor.coupling is None:
        return []
    return [f"{name} = " + " ".join(f"{share:+g} {motor}" for share, motor in
                                    zip(row, robot.joints) if share) + "  (motors over gears)"
            for name, row in zip(robot.joints, robot.motor.coupling)]


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie robot",
        "Start a robot file from a known robot, a URDF or MJCF, from logs or from nothing; or "
        "check one.",
        output=".", output_help="folder for robot.toml, or the file itself")
    parser.add_argument("source", nargs="?", type=Path, metavar="SOURCE",
                        help="URDF or MJCF, a log, a folder of logs, a robot of the gallery, or "
                             "a robot.toml to check; nothing for an empty file")
    parser.add_argument("--logs", nargs="+", type=Path, default=[], metavar="LOG",
                        help="logs of the robot of a model, in which its control law and the "
                             "steps of its encoders are looked for")
    parser.add_argument("--gallery", action="store_true",
                        help="list the known robots, with numbers from papers and datasheets")
    parser.add_argument("--check", type=Path, metavar="FILE",
                        help="say what is wrong in a robot file, line by line, and what each "
                             "missing line would buy")
    parser.add_argument("--schema", action="store_true",
                        help="print the JSON Schema of robot files, for an editor")
    parser.add_argument("--base", metavar="LINK", help="link of the model that stands still")
    parser.add_argument("--tip", metavar="LINK", help="link of the model at which the arm ends")
    parser.add_argument("--joints", type=int, default=2, metavar="N",
                        help="joints of an empty file")
    return parser


if __name__ == "__main__":
    run_main(main)
