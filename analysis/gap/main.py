"""``clie diagnose``: where a model is wrong, which effect causes it, how far the gap shrinks."""

import argparse
import shutil
import sys
from contextlib import nullcontext
from pathlib import Path

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
    from clie_blocks.analysis.gap import trials

    found = trials.find_trials(asked.paths, asked.robot)
    options = trials.Options(asked.holdout, _names(asked.effects), _names(asked.exclude),
                             simulated=tuple(map(str, asked.simulated)))
    if asked.simulated and len(found) > 1:
        raise ClieError(f"--simulated is for the logs of one robot, and there are {len(found)}: "
                        "name one trial")
    folder = asked.output
    if folder is None and asked.json and len(found) > 1:
        folder = f"{asked.json}{trials.PARTS}"
    answers = {}
    with trials.cluster(asked.cluster) if asked.cluster else nullcontext() as executor:
        for name, answer in trials.diagnose_all(found, options, asked.jobs, folder, executor):
            answers[name] = answer
            if not asked.quiet:
                print(sentence(name, answer), flush=True)
    single = len(found) == 1
    if asked.json:
        content = next(iter(answers.values())) if single and not asked.all else dict(
            sorted(answers.items()))
        write(asked.json, to_json(content))
    failed = [answer for answer in answers.values() if "error" in answer]
    if folder and Path(folder).suffix == trials.PARTS and not failed:
        shutil.rmtree(folder, ignore_errors=True)
    for answer in failed:
        print(f"error: {answer['error']}", file=sys.stderr)
    return failed[0]["exit_code"] if failed else 0


def sentence(name, answer):
    """One line for a reader: verdict, joints, probability, and what it buys."""
    from clie_blocks.analysis.gap.report.words import wrong_numbers
    from clie_blocks.analysis.gap.verdict import LIKELY

    if "error" in answer:
        return f"{name}: not diagnosed"
    likely = [row for row in answer["effects"] if row["probability"] >= LIKELY]
    causes = [_stated(answer, row) for row in likely if row["effect"] != "unknown"]
    if answer["verdict"] == "not_identifiable":
        causes = [_undecided(answer, LIKELY)]
    if answer["verdict"] == "unexplained":
        causes = [*_foreign(answer), *causes]
    closed, unseen = (answer["closed_percent"][key] for key in ("value", "unseen_data"))
    if answer["verdict"] == "parametric":
        causes = wrong_numbers(answer, _numbered(answer)) or causes
    closes = "the nearest closes" if answer["verdict"] == "unexplained" else "closes"
    bought = "" if closed is None or answer["verdict"] in ("none", "parametric") else (
        f"; {closes} {round(closed)} % of the reducible gap on "
        + ("unseen data" if unseen else "the data that it was fitted to"))
    table = answer.get("repeatable")
    rest = "" if table is None else (
        "; a torque table over place and speed beside "
        f"{' and '.join(table['beside']) or 'the refitted model'} removes "
        f"{table['percent']:.0f} % of what that leaves")
    return (f"{name}: {answer['verdict']}" + (f": {', '.join(causes)}" if causes else "") + bought
            + rest)


def _foreign(answer):
    """Something outside the library that has a name, beside the cause that moves alike."""
    from clie_blocks.analysis.gap.report.words import FOREIGN, rivalled

    return [f"{FOREIGN[row['rival']]} or {_stated(answer, row)}" for row in rivalled(answer)[:1]]


def _numbered(answer):
    return [f"joint {k + 1}" for k in range(len(answer.get("noise", ())))]


def _stated(answer, row):
    """An effect with joints and probability, and that of its family where only this is sure."""
    from clie_blocks.analysis.gap.report.words import kin

    family = kin(answer, row)
    kind = f"; {family[0]} {family[1]:.0%}" if family else ""
    return f"{row['effect']}{_where(row['joint'])} ({row['probability']:.0%}{kind})"


def _undecided(answer, least):
    """What is left where no name is likely: the family that is, or all names."""
    from clie_blocks.analysis.gap.report.words import family_of, likely_family

    likely = likely_family(answer, least)
    if likely:
        family, probability, row = likely
        return (f"{family_of(family)} ({probability:.0%}), most likely {row['effect']}"
                f"{_where(row['joint'])} ({row['probability']:.0%})")
    return " or ".join("something unknown" if name == "unknown" else name
                       for name in answer["set_90"])


def _where(joints):
    return "" if not joints else " at joint " + " and ".join(map(str, joints))


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
