"""``clie diagnose``: where a model is wrong, which effect causes it, how far the gap shrinks."""

import argparse
import shutil
import sys
from contextlib import nullcontext
from pathlib import Path

from clie_blocks.analysis.gap.report.summary import summary_line
from clie_blocks.errors import ClieError
from clie_blocks.output import run_main, to_json, write


def main(argv=None):
    """Run the command and return its exit code.

    Parameters
    ----------
    argv : list of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        0 when every trial was diagnosed; the code of the first error otherwise.

    """
    asked = _parser().parse_args(argv)
    from clie_blocks.analysis.gap import batch

    found = batch.find_tasks(asked.paths, asked.robot)
    options = batch.Options(asked.holdout, _names(asked.effects), _names(asked.exclude),
                             simulated=tuple(map(str, asked.simulated)))
    if asked.simulated and len(found) > 1:
        raise ClieError(f"--simulated is for the logs of one robot, and there are {len(found)}: "
                        "name one trial")
    folder = asked.output
    if folder is None and asked.json and len(found) > 1:
        folder = f"{asked.json}{batch.PARTS}"
    answers = {}
    with batch.cluster(asked.cluster) if asked.cluster else nullcontext() as executor:
        for name, answer in batch.diagnose_all(found, options, asked.jobs, folder, executor):
            answers[name] = answer
            if not asked.quiet:
                print(summary_line(name, answer), flush=True)
    single = len(found) == 1
    if asked.json:
        content = next(iter(answers.values())) if single and not asked.all else dict(
            sorted(answers.items()))
        write(asked.json, to_json(content))
    failed = [answer for answer in answers.values() if "error" in answer]
    if folder and Path(folder).suffix == batch.PARTS and not failed:
        shutil.rmtree(folder, ignore_errors=True)
    for answer in failed:
        print(f"error: {answer['error']}", file=sys.stderr)
    return failed[0]["exit_code"] if failed else 0


def _names(text):
    return tuple(name.strip() for name in text.split(",") if name.strip()) if text else ()


def _parser():
    parser = argparse.ArgumentParser(prog="clie diagnose", description=__doc__)
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH",
                        help="folder with robot.toml and logs, folder of such folders, or logs")
    parser.add_argument("--robot", type=Path, help="robot.toml of the logs")
    parser.add_argument("--holdout", help="log that only judges, by name or number (the last)")
    parser.add_argument("--effects", help="look for these effects only, separated by commas")
    parser.add_argument("--exclude", help="leave these effects out")
    parser.add_argument("--simulated", type=Path, nargs="+", metavar="LOG", default=[],
                        help="logs of your own simulator in the same experiments: what differs?")
    parser.add_argument("--jobs", type=int, default=1, help="trials side by side")
    parser.add_argument("--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster")
    parser.add_argument("--json", type=Path, help="write the answer; of many trials by name")
    parser.add_argument("--all", action="store_true", help="JSON by trial name, even of one trial")
    parser.add_argument("--quiet", action="store_true", help="print no verdicts")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR",
                        help="keep each result there, with its report; a later run continues")
    return parser


if __name__ == "__main__":
    run_main(main)
