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
    from clie_blocks.analysis.blind.report.page import save_page

    if importlib.util.find_spec("mujoco") is None:
        raise MissingExtraError("making blind trials", "mujoco", "mujoco")
    text = to_json(scoreboard(asked))
    write(asked.output / "scoreboard.json", text)
    found = json.loads(text)
    page = save_page(found, asked.output)
    print(text if asked.json else "\n".join(lines(found)))
    print(f"page: {page}", file=sys.stderr)
    share = found["top_1"]["rate"]
    return 1 if share is not None and share < FAIR else 0


def scoreboard(asked):
    """Run all seeds, and score them as one study."""
    from clie_blocks.analysis.blind.protocol import study
    from clie_blocks.analysis.blind.protocol.seal import unseal
    from clie_blocks.analysis.blind.protocol.targets import judged
    from clie_blocks.analysis.blind.scoring.score import score

    places = study.folders(asked.output, asked.seed)
    for seed, place in places.items():
        study.make(place, asked.trials, seed, asked.jobs)
    diagnoses = {seed: study.diagnose(place, asked.jobs) for seed, place in places.items()}
    labels = {seed: unseal(place) for seed, place in places.items()}
    found = score(study.merged(diagnoses), study.merged(labels))
    return {"schema_version": 2, "command": _command(asked), "seeds": asked.seed, **found,
            "targets": judged(found), **_further(asked, places, diagnoses, labels)}


def _further(asked, places, diagnoses, labels):
    """Further studies: on the same trials, once their labels are open, and on others."""
    from clie_blocks.analysis.blind.comparison import cross_engine, leave_one_out, methods
    from clie_blocks.analysis.blind.protocol import study
    from clie_blocks.analysis.blind.scoring import robustness

    found = {}
    if asked.leave_out:
        answers = leave_one_out.diagnosed(places, labels, asked.jobs, asked.leave_out)
        found |= leave_one_out.scored(study.merged(answers), study.merged(labels))
    if asked.engines:
        found["engines"] = cross_engine.compared(asked.engines, study.merged(diagnoses),
                                            study.merged(labels))
    methods = methods.methods(asked.baselines, asked.ablations)
    if methods:
        found["compared"] = methods.compared(methods, places, diagnoses, labels, asked.subset,
                                             asked.jobs)
    for key, family in _families().items():
        if getattr(asked, key):
            found[key] = robustness.scored(*study.sealed(
                asked.output / key, getattr(asked, key), asked.seed[0], asked.jobs, family))
    return found


def _families():
    """Families of robots that their file does not describe, by option."""
    from clie_blocks.analysis.blind.population.spatial_arms import SPATIAL
    from clie_blocks.analysis.blind.population.wrong_controller import CONTROLLERS

    return {"controllers": CONTROLLERS, "spatial": SPATIAL}


def lines(found):
    """Scoreboard for a terminal, one line per figure."""
    from clie_blocks.analysis.blind.report.wording import FAMILIES, HEADLINES, percent

    rows = [(text, percent(found[key])) for key, text in HEADLINES.items()
            if found.get(key, {}).get("of")]
    rows += [(f"{text}, a robot effect accused", percent(found[key]["accused"]))
             for key, text in FAMILIES.items() if key in found]
    width = max((len(text) for text, _ in rows), default=0)
    return [f"{found['trials']} trials, seed {', '.join(map(str, found['seeds']))}",
            *(f"  {text:{width}}  {value}" for text, value in rows)]


def _command(asked):
    parts = ["clie blind", f"--trials {asked.trials}",
             "--seed " + " ".join(map(str, asked.seed))]
    parts += [f"--{name}" for name in ("baselines", "ablations")
              if getattr(asked, name)]
    parts += [f"--leave-out {asked.leave_out}"] if asked.leave_out else []
    parts += [f"--subset {asked.subset}"] if asked.subset else []
    parts += [f"--{name} {getattr(asked, name)}" for name in ("controllers", "spatial")
              if getattr(asked, name)]
    parts += [f"--engines {asked.engines.name}"] if asked.engines else []
    return " ".join(parts)


def _parser():
    parser = argparse.ArgumentParser(prog="clie blind", description=__doc__)
    parser.add_argument("--trials", type=_count, default=20, help="how many of each seed (20)")
    parser.add_argument("--seed", type=int, nargs="+", default=[1],
                        help="of the trials; several make one study (1)")
    parser.add_argument("--jobs", type=_count, default=1, help="processes (1)")
    parser.add_argument("--leave-out", type=_count, nargs="?", const=2, metavar="MOST",
                        help="then again, each effect taken out of the library, on at most MOST "
                             "trials of it (2): is it unknown?")
    parser.add_argument("--controllers", type=_count, metavar="N",
                        help="also N sound robots whose file describes another controller")
    parser.add_argument("--spatial", type=_count, metavar="N",
                        help="also N arms whose links no planar chain describes")
    parser.add_argument("--engines", type=Path, metavar="ROBOTS",
                        help="calibrate on one engine, test on the other, both ways; ROBOTS is "
                             "the folder of robots kept by the calibration")
    parser.add_argument("--baselines", action="store_true",
                        help="the same trials by the methods that are in use today")
    parser.add_argument("--ablations", action="store_true",
                        help="the same trials with one stage of the diagnosis left out")
    parser.add_argument("--subset", type=_count, metavar="K",
                        help="baselines and ablations on K trials, spread over all kinds and "
                             "sizes (all)")
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
