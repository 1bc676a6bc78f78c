"""Robots whose two logs say little: they move between poses, and encoders are noisy."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.engine.experiments import draw_work_cycles
from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Population, Trial, make_trial
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.output import json_types, write

KINDS = ("single",) * 8 + ("none", "unknown")  # in turn
SIZES = "medium", "strong"
NOISIER = 6.0  # than the encoders of the standard study, from which the sizes are
LOGS = 2  # of three that are drawn: one is fitted, one is held out
TRAVEL, SPEED, COMMAND = 0.8, 4.0, 1.5  # rad, rad/s, times Kp: what the robot file allows
_LIMITS = """
[limits]                   # what a recommended run may reach
lower_rad = {lower}
upper_rad = {upper}
speed_rad_s = {speed}
command_nm = {command}
"""


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    lap, place = divmod(index, len(KINDS))
    kind = KINDS[place]
    order = np.random.default_rng([seed, 21])
    names: list[str] = {"single": order.permutation(list(EFFECTS)).tolist(), "none": [],
                        "unknown": order.permutation(list(OUTSIDERS)).tolist()}[kind]
    turn = lap * KINDS.count(kind) + KINDS[:place].count(kind)
    chosen = (names[turn % len(names)],) if names else ()
    size = "medium" if kind == "unknown" else SIZES[(turn + turn // len(EFFECTS)) % len(SIZES)]
    trial = draw_trial(rng, index, kind, chosen, size if chosen else None,
                       noise_factor=NOISIER, motions=draw_work_cycles)
    return dataclasses.replace(trial, experiments=trial.experiments[:LOGS],
                               runs=trial.runs[:LOGS], others=trial.others[:LOGS])


POPULATION = Population(_draw, (21,))


def write_one(folder: Path, seed: int, index: int) -> tuple[str, dict[str, Any]]:
    """Make a trial below a folder; return its name and label."""
    trial, name = make_trial(POPULATION, seed, index), f"trial-{index:03d}"
    write_robot(trial, folder / name)
    return name, json_types(trial.label)


def write_robot(trial: Trial, folder: Path) -> None:
    """Write the logs and the robot file of a trial, with the limits of the robot."""
    write_trial(trial, folder)
    robot, reached = trial.robot, np.concatenate([q for q, _ in trial.runs[:LOGS]])
    file = folder / "robot.toml"
    write(file, file.read_text() + _LIMITS.format(
        lower=_rounded(np.minimum(robot.pose - TRAVEL, reached.min(axis=0))),
        upper=_rounded(np.maximum(robot.pose + TRAVEL, reached.max(axis=0))),
        speed=SPEED, command=_rounded(COMMAND * robot.kp)))


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f"{value:.6g}") for value in values]
