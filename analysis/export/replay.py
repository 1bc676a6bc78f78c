"""The round trip: the stated law runs a MuJoCo model in the experiment of a log."""

from __future__ import annotations

import dataclasses
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.export.replay_moments import SetIn, seek_moments
from clie_blocks.analysis.export.replay_phases import Begins, seek_phases
from clie_blocks.analysis.export.simulated_model import SimulatedModel
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise


@dataclasses.dataclass(frozen=True)
class JointGap:
    """RMS prediction errors of one joint over all logs.

    Parameters
    ----------
    joint, unit : str
        Its name, and the unit of the errors.
    nominal, corrected : float
        Of the two models, which run without noise.
    floor : float
        What the noise of the encoder leaves of a right model: the noise itself, and the motion
        that it makes in the loop of the corrected model.

    """

    joint: str
    unit: str
    nominal: float
    corrected: float
    floor: float

    @property
    def closed(self) -> float:
        """Share of the gap above the floor that the correction removes [%]."""
        above = self.nominal - self.floor
        return 100.0 * (self.nominal - self.corrected) / above if above > 0.0 else 0.0


@dataclasses.dataclass(frozen=True)
class Replay:
    """What a replay found.

    Parameters
    ----------
    gaps : list of JointGap
        One per joint.
    set_in : list of SetIn
        Moments of faults, sought in the logs that are replayed.
    begins : list of Begins
        Phases of what comes again and again, sought there as well.

    """

    gaps: list[JointGap]
    set_in: list[SetIn]
    begins: list[Begins]


class OfOneLog(NamedTuple):
    """What a model and a log have for themselves: moments of events, and turns of phases."""

    moments: list[float]
    turns: list[float]

    def values(self, model: SimulatedModel) -> dict[tuple[str, str], float]:
        """Values of parameters by joint and name, see `SimulatedModel.run`."""
        found = dict(zip(model.events, self.moments, strict=True))
        for phase, turns in zip(model.phases, self.turns, strict=True):
            found |= phase.later(turns)
        return found


def seek_own_numbers(model: SimulatedModel, log: Log) -> OfOneLog:
    """Return the moments and phases at which a model is closest to a log."""
    moments = seek_moments(model, log)
    return OfOneLog(moments, seek_phases(
        model, log, dict(zip(model.events, moments, strict=True))))


def replay(problem: Problem, corrected: str | PathLike[str],
           nominal: str | PathLike[str] | None = None) -> Replay:
    """Return the gap of each joint, of the nominal and of the corrected model, and its floor.

    What sets in at a moment of a log does so where that log shows it, see `seek_moments`, and
    what comes again and again has the phase that the log shows, see `seek_phases`.

    The measured motion holds what the noise of the encoder did to it, which no simulation repeats:
    a right model leaves the floor, and not zero.

    Parameters
    ----------
    problem : Problem
        Robot, logs and law.
    corrected : path-like
        The corrected MJCF.
    nominal : path-like, optional
        The user's MJCF before the correction; by default the model that the robot file states,
        run by the blocks of this package.

    """
    model = SimulatedModel(corrected, problem)
    sought = [seek_own_numbers(model, log) for log in problem.law_logs]
    own = [one.values(model) for one in sought]
    quiet = [model.run(log, own=of_log)
             for log, of_log in zip(problem.law_logs, own, strict=True)]
    after = _rms([log.bridged(log.law_q - q)
                  for log, q in zip(problem.law_logs, quiet, strict=True)])
    floor = _floor(model, problem, quiet, own)
    if nominal is None:
        stated = build_hypothesis(problem, ())
        before = _rms([stated.error(j, dithered=False) for j in range(len(problem.logs))
                       if not problem.logs[j].of_other_encoder])
    else:
        user = SimulatedModel(nominal, problem)
        before = _rms([log.bridged(log.law_q - user.run(log)) for log in problem.law_logs])
    unit = problem.records[0].units["q"]
    gaps = [JointGap(name, unit[k] if unit[k] == "m" else "rad", float(before[k]),
                     float(after[k]), float(floor[k]))
            for k, name in enumerate(problem.joints)]
    by_log = [(Path(log.name).name, one)
              for log, one in zip(problem.law_logs, sought, strict=True)]
    return Replay(gaps, [SetIn(name, joint, parameter, moment) for name, one in by_log
                         for (joint, parameter), moment in zip(model.events, one.moments)],
                  [Begins(name, phase.joint, phase.name, turns) for name, one in by_log
                   for phase, turns in zip(model.phases, one.turns)])


def _floor(model: SimulatedModel, problem: Problem, quiet: list[np.ndarray],
           own: list[dict[tuple[str, str], float]]) -> np.ndarray:
    """RMS of what noise of the encoders does to a model: as it is seen, and through the loop."""
    sigma = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    rng = np.random.default_rng(0)
    noise = [sigma * rng.standard_normal(q.shape) for q in quiet]
    return _rms([log.bridged(model.run(log, one, of_log) + one - q) for log, one, q, of_log in zip(
        problem.law_logs, noise, quiet, own, strict=True)])


def _rms(errors: list[np.ndarray]) -> np.ndarray:
    return np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))
