"""Two folders or logs of one robot, loaded and unloaded, from their paths."""

from pathlib import Path

from clie_blocks.analysis.gap.batch import Options, state
from clie_blocks.analysis.gap.load_comparison.compare import LoadDifference, compare_loads
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.tasks import find_tasks
from clie_blocks.errors import RecordError

NO_OPTIONS = Options()


def compare_paths(loaded: Path, unloaded: Path, robot: Path | None = None,
                  options: Options = NO_OPTIONS) -> LoadDifference:
    """Find the load between the logs of two paths.

    Parameters
    ----------
    loaded, unloaded : path-like
        Folders with ``robot.toml`` and logs, or logs.
    robot : path-like, optional
        Robot file of both.
    options : Options
        How the logs are read; what is searched for does not count.

    Raises
    ------
    RecordError
        If a path is of several robots, or the two are of different ones.
    NotIdentifiableError
        If no torque is logged, or several joints move and no links are stated.

    """
    return compare_loads(*(_problem(path, robot, options) for path in (loaded, unloaded)))


def _problem(path: Path, robot: Path | None, options: Options) -> Problem:
    tasks = find_tasks([path], robot)
    if len(tasks) != 1:
        raise RecordError(f"{path} holds {len(tasks)} robots, and a comparison is of one; name "
                          f"one of {', '.join(task.name for task in tasks)}")
    return state(tasks[0], options)
