"""One robot: diagnosed, run as recommended in the engine, and diagnosed with the new log."""

import dataclasses
import json
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run_both
from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.exporter import logged_command
from clie_blocks.analysis.blind.experiments.trials import NOISIER, POPULATION, write_robot
from clie_blocks.analysis.blind.population.maker import Trial, leaves_set_point, make_trial
from clie_blocks.analysis.blind.scoring.classes import as_classes
from clie_blocks.analysis.blind.scoring.decisions import Answer
from clie_blocks.output import to_json, write

RUNS = 3  # at most
HELD_OUT = "log-2"  # in every round, so that new logs are fitted
NOISE_STREAM = 31


def follow(folder: Path, seed: int, index: int) -> list[dict[str, Any]]:
    """Return the rounds of one trial: the first answer, and that after each executed run.

    Parameters
    ----------
    folder : Path
        Where its logs are collected; a robot that was followed before is read back.
    seed, index : int
        Of the trial, whose engine stands for the robot.

    """
    kept = folder / "rounds.json"
    if kept.is_file():
        rounds: list[dict[str, Any]] = json.loads(kept.read_text())
        return rounds
    trial, rounds, used = make_trial(POPULATION, seed, index), [], None
    while True:
        write_robot(trial, folder)
        plain, set_points = _answer(folder)
        rounds.append(plain | {"used": used})
        if not is_ambiguous(plain) or set_points is None or len(rounds) > RUNS:
            break
        ran = execute(trial, set_points, seed, index, len(rounds))
        if ran is None:
            rounds[-1]["left"] = True
            break
        trial, used = ran, _used(folder, ran)
    write(kept, to_json(rounds))
    rounds = json.loads(kept.read_text())
    return rounds


def is_ambiguous(plain: dict[str, Any]) -> bool:
    """Whether an answer leaves more than one class, or leads with less than half."""
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    if "error" in plain:
        return False
    answer = Answer(as_classes(plain, class_of))
    return answer.set_size > 1 or answer.confidence < 0.5


def _answer(folder: Path) -> tuple[dict[str, Any], str | None]:
    """Answer to what a folder holds, in short, and the set-points that it recommends."""
    from clie_blocks.analysis.gap.batch import Options, state
    from clie_blocks.analysis.gap.diagnosis import diagnose
    from clie_blocks.analysis.gap.tasks import find_tasks
    from clie_blocks.errors import ClieError

    (task,) = find_tasks([folder])
    try:
        problem = state(task, Options(holdout=HELD_OUT))
        diagnosis = diagnose(problem)
    except ClieError as error:
        return {"error": str(error)}, None
    plain, following = diagnosis.to_dict(), diagnosis.next_experiment
    short = {key: plain[key] for key in (
        "verdict", "effects", "set_90", "unexplained", "gap_before", "gap_after",
        "next_experiment", "seconds", "log")}
    return short, following and following.set_points(problem.records[0].units)


def execute(trial: Trial, set_points: str, seed: int, index: int, turn: int) -> Trial | None:
    """Return the trial with one more log, of a run with some set-points; None if it runs off.

    Parameters
    ----------
    trial : Trial
        The robot.
    set_points : str
        CSV with the columns time, qd and pe.
    seed, index, turn : int
        Of the noise.

    """
    robot, truth = trial.robot, trial.truth
    assert truth is not None  # of every standard trial
    table = np.atleast_2d(np.genfromtxt(StringIO(set_points), delimiter=",", skip_header=1))
    q_d, pe = table[:, 1:1 + robot.n], table[:, 1 + robot.n:]
    experiment = Experiment("other", q_d[0], q_d, pe)
    noise = NOISIER * robot.sigma * np.random.default_rng(
        [seed, index, turn, NOISE_STREAM]).standard_normal(q_d.shape)
    ((q, u, other),) = run_both(robot, [truth], [experiment], [noise], seed=index)
    if leaves_set_point([experiment], [(q, u)]):
        return None
    return dataclasses.replace(
        trial, experiments=[*trial.experiments, experiment],
        runs=[*trial.runs, (q, logged_command(u, robot.period, truth))],
        others=[*trial.others, other] if robot.two_encoders else ())


def _used(folder: Path, trial: Trial) -> list[float]:
    """Largest shares of the stated limits of position, speed and command in the last run."""
    from clie_blocks.analysis.gap.assessment.test_motions import motion_limits, used_limits
    from clie_blocks.analysis.gap.batch import read

    problem = read(folder)
    shares = used_limits(*trial.runs[-1], motion_limits(problem), problem.period)
    return [float(share) for share in shares.max(axis=1)]
