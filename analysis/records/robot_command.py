"""``clie robot``: start a robot file from a URDF, an MJCF, logs or nothing, and check one."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.analysis.records.robot_template import MARK, robot_text, robot_text_of_model
from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, print_table, run_main, to_json, write
from clie_blocks.rigid_body.dynamics import gravity_torque, mass_matrix
from clie_blocks.rigid_body.model_file import MODEL_FILES

NAME = "robot.toml"
_POSES = 200  # at random within the limits, of which the largest torque is shown
_WHOLE_TURN = np.pi


def main(argv: list[str] | None = None) -> int:
    """Run the command; return 0 if the robot file was written or is sound."""
    args = _parser().parse_args(argv)
    source: Path | None = args.source
    if source is not None and source.suffix == ".toml":
        robot = read_robot(source)
        facts = _facts(robot)
        print(to_json(facts) if args.json else "", end="\n" if args.json else "")
        if not args.json:
            _show(robot, facts)
        return 0
    path = Path(args.output) / NAME
    if path.exists():
        raise ClieError(f"{path} is there already and is left as it is; name another folder with "
                        "-o DIR, or check the file: clie robot " + str(path))
    text = _text(source, path.parent, args)
    write(path, text)
    marks = text.count(f"\n{MARK} ")
    if args.json:
        print(to_json({"file": str(path), "lines_for_you": marks}))
    else:
        print(f"wrote {path}: {marks} lines that begin with '{MARK}' are for you; then: "
              f"clie robot {path}")
    return 0


def _text(source: Path | None, folder: Path, args: argparse.Namespace) -> str:
    """Text of the robot file."""
    if source is None:
        return robot_text("my robot", [f"joint{k + 1}" for k in range(args.joints)])
    if source.suffix.lower() in MODEL_FILES:
        return robot_text_of_model(source, folder, args.base, args.tip)
    from clie_blocks.analysis.records.read import read_records

    return robot_text(source.stem, read_records(source)[0].joints)


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
    motor, links, law = robot.motor, robot.links, robot.controller
    lines = []
    if motor.gear_ratio is None:
        lines.append("[motor] gear_ratio: taken as 1, so that torques count on the joint side")
    if motor.inertia is None:
        lines.append("[motor] inertia_kgm2: inertia and damping are those that fit the logs, and "
                     "a wrong one is not found")
    if robot.tree is None and links.mass is None:
        lines.append("[links]: weight, coupling and payload cannot be told from other torques of "
                     "the pose; name a model, model = \"arm.urdf\"")
    if law.law == "unknown":
        lines.append("[controller] Kp, Kd: the loop cannot be simulated, what drives the robot is "
                     "taken from the log")
    elif law.sample_time is None:
        lines.append("[controller] sample_time_s: that of the logs is taken")
    return lines


def _show(robot: Robot, facts: dict[str, Any]) -> None:
    print(f"{robot.source}: {robot.name or 'robot'}, {robot.n} joints")
    if robot.tree is not None:
        print(f"links of {robot.links.model}: {facts['mass']:.4g} kg")
        print_table(("joint", "largest weight [N m]", "largest inertia [kg m^2]"),
                    [(name, f"{weight:.3g}", f"{inertia:.3g}") for name, weight, inertia in
                     zip(robot.joints, facts["largest_weight"], facts["largest_inertia"])],
                    "<>>")
    for line in _coupled(robot):
        print(line)
    for line in facts["open"]:
        print(f"not stated: {line}")
    print("Next: clie check FOLDER, with the logs beside this file")


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
        "Start a robot file from a URDF or MJCF, from logs or from nothing; or check one.",
        output=".", output_help="folder for robot.toml")
    parser.add_argument("source", nargs="?", type=Path, metavar="SOURCE",
                        help="URDF or MJCF, a log, a folder of logs, or a robot.toml to check; "
                             "nothing for an empty file")
    parser.add_argument("--base", metavar="LINK", help="link of the model that stands still")
    parser.add_argument("--tip", metavar="LINK", help="link of the model at which the arm ends")
    parser.add_argument("--joints", type=int, default=2, metavar="N",
                        help="joints of an empty file")
    return parser


if __name__ == "__main__":
    run_main(main)
