"""One diagnosis of a trial, exported to MuJoCo and run there on the log that no fit has seen."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.stats import norm

from clie_blocks.analysis.export.correction import Correction, correction_of
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.analysis.export.replay import seek_own_numbers
from clie_blocks.analysis.export.samples import BAND, draw
from clie_blocks.analysis.export.simulated_model import SimulatedModel
from clie_blocks.analysis.gap.batch import read
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Robot, read_robot
from clie_blocks.errors import ClieError

SAMPLES = 24
LONGEST_STEP = 1.25e-4  # s
MODEL = """<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step!r}" integrator="RK4" gravity="0 0 {gravity!r}"/>
  <worldbody>
    <body>
      <inertial pos="{com!r} 0 0" mass="{mass!r}"
                diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>
      <joint name="{name}" axis="0 -1 0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="{name}" joint="{name}" gear="{gear!r}"/>
  </actuator>
</mujoco>
"""


def own_model(robot: Robot, period: float) -> str:
    """MJCF of a joint as its user has it: the link, and a motor with the stated gear."""
    links, motor = robot.links, robot.motor
    if links.mass is None or links.com is None or links.inertia is None:
        raise ClieError(f"{robot.name}: no link is stated, and a model needs one")
    return MODEL.format(
        step=period / math.ceil(period / LONGEST_STEP - 1e-9), name=robot.joints[0],
        gravity=-robot.nominal.g if robot.nominal.gravity else 0.0, mass=float(links.mass[0]),
        com=float(links.com[0]), inertia=float(links.inertia[0]),
        gear=1.0 if motor.gear_ratio is None else float(motor.gear_ratio[0]))


def measure(trial: Path, answer: dict[str, Any], samples: int = SAMPLES) -> dict[str, Any]:
    """Return the gap of an exported correction in MuJoCo, and how often its band is right.

    Parameters
    ----------
    trial : Path
        Folder with the robot file and the logs.
    answer : dict
        Its diagnosis.
    samples : int
        Corrections drawn for the band.

    Returns
    -------
    dict
        ``gap`` on the unseen log [rad]; ``coverage``, the share of its samples within the nominal
        90 % band, or None where the correction needs the module beside the model, which is slow.

    """
    correction = correction_of(answer, trial.name)
    robot, problem = read_robot(trial / "robot.toml"), read(trial)
    with TemporaryDirectory() as folder:
        own = Path(folder) / "own.xml"
        own.write_text(own_model(robot, problem.period))
        found = export_mujoco(correction, own)
        errors = _errors(found, Path(folder), problem)
        module = any(name.endswith(".py") for name in found.files)
        gap = float(np.sqrt(np.mean(errors**2)))
        if module:
            return {"gap": gap, "coverage": None, "module": True}
        sigma, rng = float(answer["noise"][0]["sigma"]), np.random.default_rng(0)
        drawn = [_errors(export_mujoco(one, own), Path(folder), problem, sigma * noise)
                 for one, noise in zip(_draws(correction, samples), rng.standard_normal(
                     (samples, *problem.held_out[-1].q.shape)), strict=True)]
    return {"gap": gap, "module": False, "coverage": coverage(np.array(drawn), sigma)}


def coverage(errors: np.ndarray, noise: float) -> float:
    """Share of a log that lies within the nominal 90 % band of some models and the noise.

    Parameters
    ----------
    errors : ndarray, shape (samples, N)
        Measured position less that of each model, whose law saw noise, too [rad].
    noise : float
        Standard deviation of the noise of the sensor [rad].

    """
    below = norm.cdf(errors / noise).mean(axis=0)  # quantile of the measured position
    return float(np.mean((below >= BAND[0]) & (below <= BAND[1])))


def _draws(correction: Correction, samples: int) -> tuple[Correction, ...]:
    return draw(correction, samples).corrections


def _errors(found: Exported, folder: Path, problem: Problem, noise: np.ndarray | None = None,
            ) -> np.ndarray:
    """Measured less simulated position on the log that was held out (N,) [rad]."""
    paths = found.save(folder)
    model = next(path for path in paths if path.name.endswith(".corrected.xml"))
    log = problem.held_out[-1]
    simulated = SimulatedModel(model, problem)
    own = seek_own_numbers(simulated, log).values(simulated)
    return (log.law_q - simulated.run(log, noise, own))[:, 0]
