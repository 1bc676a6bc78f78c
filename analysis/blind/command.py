"""``clie blind``: sealed trials of the diagnosis: make, seal, diagnose, unseal, score."""

import argparse
import importlib.util
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clie_blocks.analysis.blind.further_studies import FURTHER_STUDIES, FurtherStudy
from clie_blocks.errors import ClieError, MissingExtraError
from clie_blocks.output import command_parser, run_main, to_json, write

if TYPE_CHECKING:
    from clie_blocks.analysis.blind.population.maker import Population
    from clie_blocks.analysis.blind.protocol.targets import Target

FAIR = 0.5  # share of single effects named right below which the result is negative


def main(argv: list[str] | None = None) -> int:
    """Run a study, or continue one, and return the exit code.

    It is 1 if less than half of the single effects were named right, if imperfect logs miss a
    target for certain, or if another study misses what it seeks first, else 0.
    """
    options = _parser().parse_args(argv)
    options.output = Path(options.output)
    if importlib.util.find_spec("mujoco") is None:
        raise MissingExtraError("making blind trials", "mujoco", "mujoco")
    if options.imperfect:
        return _imperfect(options)
    for study in FURTHER_STUDIES:
        if getattr(options, study.name):
            return _further_study(study, options)
    from clie_blocks.analysis.blind.report.page import save_page
    from clie_blocks.analysis.blind.scoring.timings import FILE, without_timings

    figures, timings = without_timings(scoreboard(options))
    text = to_json(figures)
    write(options.output / "scoreboard.json", text)
    write(options.output / FILE, to_json(timings))
    board = json.loads(text)
    page = save_page(board, options.output)
    print(text if options.json else "\n".join(terminal_lines(board)))
    print(f"page: {page}", file=sys.stderr)
    share = board["top_1"]["rate"]
    return 1 if share is not None and share < FAIR else 0


def _imperfect(options: argparse.Namespace) -> int:
    """Run the study of imperfect logs, and return the exit code."""
    from clie_blocks.analysis.blind.imperfect.study import run_study
    from clie_blocks.analysis.blind.protocol.targets import MISSED
    from clie_blocks.analysis.blind.report import imperfect
    from clie_blocks.analysis.blind.scoring.imperfect import score_imperfect

    board = score_imperfect(*run_study(options.output, options.trials, options.seed,
                                       options.jobs))
    text = to_json({"schema_version": 1, "command": _command(options), "seeds": options.seed,
                    **board})
    write(options.output / f"{imperfect.STEM}.json", text)
    page = imperfect.save_page(json.loads(text), options.output)
    print(text if options.json else "\n".join(imperfect.terminal_lines(json.loads(text))))
    print(f"page: {page}", file=sys.stderr)
    return int(any(row["reached"] == MISSED for row in board["targets"]))


def _further_study(study: FurtherStudy, options: argparse.Namespace) -> int:
    """Run a study with figures of its own, and return the exit code."""
    module = study.module
    board = {"schema_version": 1, "command": _command(options), **module.run_study(
        options.output, getattr(options, study.name), _only_seed(options), options.jobs)}
    text = to_json(board)
    write(options.output / f"{study.name}.json", text)
    board = json.loads(text)
    print(text if options.json else "\n".join(module.terminal_lines(board)))
    return int(module.is_missed(board))


def _only_seed(options: argparse.Namespace) -> int:
    """The seed of a study that has one."""
    if len(options.seed) > 1:
        raise ClieError(f"this study has one seed, not {len(options.seed)}: run it once for each, "
                        "with a folder of its own (-o DIR)")
    seed: int = options.seed[0]
    return seed


def scoreboard(options: argparse.Namespace) -> dict[str, Any]:
    """Run all seeds, and score them as one study."""
    from clie_blocks.analysis.blind.protocol import study
    from clie_blocks.analysis.blind.protocol.seal import unseal
    from clie_blocks.analysis.blind.protocol.targets import compare_with_targets
    from clie_blocks.analysis.blind.scoring.by_name import score_by_name
    from clie_blocks.analysis.blind.scoring.score import score
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    trials, population, targets = _study(options)
    folders = study.seed_folders(options.output, options.seed)
    for seed, folder in folders.items():
        study.make_trials(folder, trials, seed, options.jobs, population)
    diagnoses = {seed: study.diagnose_trials(folder, options.jobs)
                 for seed, folder in folders.items()}
    labels = {seed: unseal(folder) for seed, folder in folders.items()}
    merged = study.merge_seeds(diagnoses), study.merge_seeds(labels)
    board = score(*merged, class_of)
    if options.catalogue:
        board["by_name"] = score_by_name(*merged, class_of)
    return {"schema_version": 3, "command": _command(options), "seeds": options.seed, **board,
            "targets": compare_with_targets(board, targets),
            **_further_studies(options, folders, diagnoses, labels)}


def _study(options: argparse.Namespace) -> "tuple[int, Population, Sequence[Target]]":
    """Trials of each seed, the population that they come from, and what is to be reached."""
    from clie_blocks.analysis.blind.population.arms_in_space import ARMS_IN_SPACE
    from clie_blocks.analysis.blind.population.catalogue import LAP, WHOLE_CATALOGUE
    from clie_blocks.analysis.blind.population.standard import STANDARD
    from clie_blocks.analysis.blind.protocol import targets

    if options.catalogue:
        return options.catalogue * LAP, WHOLE_CATALOGUE, targets.CATALOGUE_TARGETS
    if options.arms:
        return options.arms, ARMS_IN_SPACE, targets.ARMS_TARGETS
    return options.trials, STANDARD, targets.TARGETS


def _further_studies(options: argparse.Namespace, folders: dict[int, Path],
                     diagnoses: dict[int, dict[str, Any]],
                     labels: dict[int, dict[str, Any]]) -> dict[str, Any]:
    """Further studies: on the same trials, once their labels are open, and on others."""
    from clie_blocks.analysis.blind.comparison import cross_engine, leave_one_out, methods
    from clie_blocks.analysis.blind.protocol import study
    from clie_blocks.analysis.blind.scoring import robustness

    results: dict[str, Any] = {}
    if options.leave_out:
        answers = leave_one_out.diagnose_without_own_effect(folders, labels, options.jobs,
                                                            options.leave_out)
        results |= leave_one_out.score_left_out(study.merge_seeds(answers),
                                                study.merge_seeds(labels))
    if options.engines:
        results["engines"] = cross_engine.calibrate_across_engines(
            options.engines, study.merge_seeds(diagnoses), study.merge_seeds(labels))
    names = methods.method_names(options.baselines, options.ablations)
    if names:
        results["compared"] = methods.compare_methods(names, folders, diagnoses, labels,
                                                      options.subset, options.jobs)
    for key, population in _misdescribed_populations().items():
        if getattr(options, key):
            results[key] = robustness.score_misdescribed(*study.run_sealed(
                options.output / key, getattr(options, key), options.seed[0], options.jobs,
                population))
    return results


def _misdescribed_populations() -> "dict[str, Population]":
    """Populations of robots that their file does not describe, by option."""
    from clie_blocks.analysis.blind.population.spatial_arms import SPATIAL
    from clie_blocks.analysis.blind.population.wrong_controller import CONTROLLERS

    return {"controllers": CONTROLLERS, "spatial": SPATIAL}


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal, one line per figure."""
    from clie_blocks.analysis.blind.report.wording import HEADLINES, POPULATIONS, percent

    rows = [(text, percent(board[key])) for key, text in HEADLINES.items()
            if board.get(key, {}).get("of")]
    rows += [(f"{text}, false attribution to the robot", percent(board[key]["accused"]))
             for key, text in POPULATIONS.items() if key in board]
    width = max((len(text) for text, _ in rows), default=0)
    return [f"{board['trials']} trials, seed {', '.join(map(str, board['seeds']))}",
            *(f"  {text:{width}}  {value}" for text, value in rows)]


def _command(options: argparse.Namespace) -> str:
    counted = (*(study.option for study in FURTHER_STUDIES), "catalogue", "arms", "trials")
    counts = {option: getattr(options, option.replace("-", "_")) for option in counted}
    count = next(f"--{option} {number}" for option, number in counts.items() if number)
    parts = ["clie blind --imperfect" if options.imperfect else "clie blind", count,
             "--seed " + " ".join(map(str, options.seed))]
    parts += [f"--{name}" for name in ("baselines", "ablations") if getattr(options, name)]
    parts += [f"--leave-out {options.leave_out}"] if options.leave_out else []
    parts += [f"--subset {options.subset}"] if options.subset else []
    parts += [f"--{name} {getattr(options, name)}" for name in ("controllers", "spatial")
              if getattr(options, name)]
    parts += [f"--engines {options.engines.name}"] if options.engines else []
    return " ".join(parts)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser("clie blind", "Run sealed trials of the diagnosis: make, seal, "
                            "diagnose, unseal, score.", output="blind",
                            output_help="folder of the study; a later run continues it")
    parser.add_argument("--imperfect", action="store_true",
                        help="instead, standard robots whose logs or robot file are damaged as "
                             "loggers and exporters do, beside the same robots undamaged; goes "
                             "with --trials, --seed and --jobs")
    parser.add_argument("--catalogue", type=_count, metavar="N",
                        help="instead, every name of the catalogue N times for each seed, with "
                             "effects that it does not hold and robots that have none")
    parser.add_argument("--arms", type=_count, metavar="N",
                        help="instead, N arms of four to seven axes in space for each seed, whose "
                             "links a URDF or MJCF states within a tolerance")
    for study in FURTHER_STUDIES:
        parser.add_argument(f"--{study.option}", type=_count, metavar="N", help=study.help)
    parser.add_argument("--trials", type=_count, default=20, metavar="N",
                        help="trials of each seed")
    parser.add_argument("--seed", type=int, nargs="+", default=[1], metavar="N",
                        help="of the trials; several make one study")
    parser.add_argument("--jobs", type=_count, default=1, metavar="N", help="processes")
    parser.add_argument("--leave-out", type=_count, nargs="?", const=2, metavar="MOST",
                        help="then diagnose again with each effect removed from the library, on "
                             "at most MOST trials of it (2): is it reported as unknown?")
    parser.add_argument("--controllers", type=_count, metavar="N",
                        help="also N healthy robots whose file describes another controller")
    parser.add_argument("--spatial", type=_count, metavar="N",
                        help="also N arms whose links no planar chain describes")
    parser.add_argument("--engines", type=Path, metavar="ROBOTS",
                        help="calibrate on one engine and test on the other, both ways; ROBOTS "
                             "is the folder of robots kept by the calibration")
    parser.add_argument("--baselines", action="store_true",
                        help="the same trials by the methods that are in use today")
    parser.add_argument("--ablations", action="store_true",
                        help="the same trials with one stage of the diagnosis removed")
    parser.add_argument("--subset", type=_count, metavar="K",
                        help="baselines and ablations on K trials, spread over all kinds and "
                             "sizes; by default on all")
    return parser


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a count of at least 1")
    return value


if __name__ == "__main__":
    run_main(main)
