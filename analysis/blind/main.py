"""``clie blind``: sealed trials of the diagnosis: make, seal, diagnose, unseal, score."""

import argparse
import importlib.util
import json
import sys
from pathlib import Path

from clie_blocks.errors import MissingExtraError
from clie_blocks.output import run_main, to_json, write

FAIR = 0.5  # share of single effects named right below which the news is bad


def main(argv=None):
    """Run a study, or go on with one, and return the exit code.

    Parameters
    ----------
    argv : list of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        0; 1 where less than half of the single effects were named right.

    """
    asked = _parser().parse_args(argv)
    from clie_blocks.analysis.blind import study
    from clie_blocks.analysis.blind.page import save_page
    from clie_blocks.analysis.blind.score import left_out, score
    from clie_blocks.analysis.blind.seal import unseal

    if importlib.util.find_spec("mujoco") is None:
        raise MissingExtraError("making blind trials", "mujoco", "mujoco")
    study.make(asked.output, asked.trials, asked.seed, asked.jobs)
    diagnoses = study.diagnose(asked.output, asked.jobs)
    labels = unseal(asked.output)
    found = {"schema_version": 1, "seed": asked.seed, **score(diagnoses, labels)}
    if asked.leave_out:
        found |= left_out(study.leave_out(asked.output, labels, asked.jobs), labels)
    text = to_json(found)
    write(asked.output / "scoreboard.json", text)
    page = save_page(json.loads(text), asked.output)
    if asked.json:
        print(text)
    else:
        print("\n".join(lines(found)))
    print(f"page: {page}", file=sys.stderr)
    share = found["top_1"]["rate"]
    return 1 if share is not None and share < FAIR else 0


def lines(found):
    """Scoreboard for a terminal, one line per figure."""
    from clie_blocks.analysis.blind.page import HEADLINES, percent

    rows = [(text, percent(found[key])) for key, text in HEADLINES.items()
            if found.get(key, {}).get("of")]
    width = max((len(text) for text, _ in rows), default=0)
    return [f"{found['trials']} trials, seed {found['seed']}",
            *(f"  {text:{width}}  {value}" for text, value in rows)]


def _parser():
    parser = argparse.ArgumentParser(prog="clie blind", description=__doc__)
    parser.add_argument("--trials", type=_count, default=20, help="how many (20)")
    parser.add_argument("--seed", type=int, default=1, help="of all trials (1)")
    parser.add_argument("--jobs", type=_count, default=1, help="processes (1)")
    parser.add_argument("--leave-out", action="store_true",
                        help="then again, each effect taken out of the library: is it unknown?")
    parser.add_argument("--json", action="store_true", help="print the scoreboard as JSON")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", default=Path("blind"),
                        help="folder of the study; a later run continues (blind)")
    return parser


def _count(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a count of at least 1")
    return value


if __name__ == "__main__":
    run_main(main)
