"""The control law of a robot file as a block, where it is a Python program of the user's own."""

from __future__ import annotations

from pathlib import Path

from clie_blocks.analysis.records.robot import PROGRAM, Robot, with_law
from clie_blocks.errors import ClieError, nearest
from clie_blocks.user_files import run_file


def with_law_of_file(robot: Robot) -> Robot:
    """Robot with the block that its robot file names as FILE.py:NAME; other robots as they are.

    The file is run: read it before.  Its path is relative to the robot file.

    Raises
    ------
    ClieError
        If the file cannot be read or fails, with the line, or defines no block of that name.

    """
    law = robot.controller.law
    if not robot.controller.is_program or law == PROGRAM:
        return robot
    path = law_file(robot)
    name = law.rpartition(":")[2]
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


def law_file(robot: Robot) -> Path:
    """Path of the file that defines the law of a robot."""
    return Path(robot.source or ".").parent / robot.controller.law.rpartition(":")[0]
