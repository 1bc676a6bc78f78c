"""The control law of a robot file as a block, where it is a program of the user's own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from clie_blocks.analysis.records.controller_section import PROGRAM
from clie_blocks.analysis.records.robot import Robot, with_law
from clie_blocks.errors import ClieError, nearest
from clie_blocks.user_files import run_file

if TYPE_CHECKING:
    from control import NonlinearIOSystem


def with_law_of_file(robot: Robot) -> Robot:
    """Robot with the law that its robot file names as FILE.py:NAME or FILE.c:NAME; others as is.

    The file is run, or compiled and run: read it before.  Its path is relative to the robot file.

    Raises
    ------
    ClieError
        If the file cannot be read or fails, with the line, or defines no law of that name.

    """
    law = robot.controller.law
    if not robot.controller.is_program or law == PROGRAM:
        return robot
    path, name = law_file(robot), law.rpartition(":")[2]
    if path.suffix == ".c":
        return with_law(robot, _law_in_c(robot, path, name))
    if robot.controller.parameters is not None:
        raise ClieError(f"{robot.source}: parameters are those of a law in C, and {law!r} is "
                        "Python: write them into params of its block")
    defined = run_file(path, "control law")
    block = defined.get(name)
    if block is None:
        own = [key for key, value in defined.items() if hasattr(value, "input_labels")]
        raise ClieError(f"{path}: it defines no {name!r}, which {robot.source} names as the "
                        f"control law; {nearest(name, own)}")
    if not hasattr(block, "input_labels"):
        raise ClieError(f"{path}: {name} is no block of python-control but "
                        f"{type(block).__name__}; write {name} = ct.nlsys(update, output, dt=..., "
                        "inputs=['q_d[0]', ..., 'q[0]', ...], outputs=['u[0]', ...])")
    return with_law(robot, block)


def _law_in_c(robot: Robot, path: Path, name: str) -> NonlinearIOSystem:
    from clie_blocks.controllers.law_in_c import law_in_c

    law = robot.controller
    return law_in_c(path, name, robot.n, law.sample_time or True, parameters=law.parameters)


def law_file(robot: Robot) -> Path:
    """Path of the file that defines the law of a robot."""
    return Path(robot.source or ".").parent / robot.controller.law.rpartition(":")[0]
