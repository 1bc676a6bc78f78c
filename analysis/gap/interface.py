"""The diagnosis as it is called from Python: of a problem, or of logs where they lie."""

import os
from collections.abc import Sequence

from clie_blocks.analysis.gap import batch
from clie_blocks.analysis.gap.diagnosis import Diagnosis
from clie_blocks.analysis.gap.diagnosis import diagnose as diagnose_problem
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.stages import STAGES, Stages
from clie_blocks.errors import ClieError

Path = str | os.PathLike[str]


def diagnose(subject: Problem | Path | Sequence[Path], method: Method = METHOD,
             effects: Sequence[str] = (), exclude: Sequence[str] = (), stages: Stages = STAGES,
             seconds: float = 120.0, *, robot: Path | None = None, trust_logs: bool = False,
             run_law: bool = False) -> Diagnosis:
    """Find the effects that make a robot differ from its model, where they act, and their share.

    Parameters
    ----------
    subject : Problem, path-like or sequence of path-like
        A folder with ``robot.toml`` and logs, log files of one robot, or a problem:
        ``Problem.from_logs(robot, records)``, ``Problem.from_loop(loop, records)``; with
        ``.beside(simulated)``, what differs between the robot and the user's own simulator.
    method : Method
        Thresholds.
    effects, exclude : sequence of str
        Effects to search for (all when empty), and effects to leave out.
    stages : Stages
        The functions that run.
    seconds : float
        Budget: the search ends early enough to answer within it, with what was fitted by then.
    robot : path-like, optional
        Robot file of log files; else the one beside them.
    trust_logs : bool
        Of paths: correct nothing in the logs, and stop for nothing that a check finds in them.
    run_law : bool
        Of paths: run the control law that the robot file names, where it is a Python file.

    Returns
    -------
    Diagnosis
        It prints in a few lines, and has ``report(folder)``, ``plot(name)`` and ``to_dict()``.

    Raises
    ------
    RecordError
        If a path holds nothing that can be diagnosed, or holds several robots.
    ClieError
        If `robot`, `trust_logs` or `run_law` is given beside a problem, which is stated already.

    """
    if isinstance(subject, Problem):
        if robot is not None or trust_logs or run_law:
            raise ClieError("robot, trust_logs and run_law say how paths are read, and a problem "
                            "is stated already; give them to gap.read or Problem.from_logs")
        problem = subject
    else:
        paths = [subject] if isinstance(subject, (str, os.PathLike)) else subject
        problem = batch.read(*paths, robot=robot, trust_logs=trust_logs, run_law=run_law)
    return diagnose_problem(problem, method, effects, exclude, stages, seconds)
