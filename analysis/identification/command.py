"""``clie identify``: parameters of a recorded robot, every method in one table."""

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.identification import Identification, identify
from clie_blocks.analysis.identification.agreement import agreement
from clie_blocks.analysis.identification.columns import EXTRA
from clie_blocks.analysis.identification.identification import Bias
from clie_blocks.analysis.identification.prediction import Prediction
from clie_blocks.analysis.identification.regression import Estimate
from clie_blocks.analysis.records.corrections import examine
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.read import read_logs, refuse_twins
from clie_blocks.analysis.records.reading import add_reading_options, reading
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.output import (
    command_parser,
    print_table,
    progress,
    run_main,
    save_figure,
    to_json,
    wrapped,
    write,
)

SCHEMA_VERSION = 1
MISSING = 1.5  # times the noise; a larger error is not noise alone


def main(argv: list[str] | None = None) -> int:
    """Identify a robot from logs; of several the last is held out unless stated otherwise."""
    options = _parser().parse_args(argv)
    robot = read_robot(options.robot) if options.robot else None
    with progress("identifying"):
        stated = reading(options).keywords()
        records = read_logs(options.logs, robot, **stated)
        held_out = read_logs(options.holdout, robot, **stated)
        refuse_twins([*records, *held_out])
        if not options.holdout and len(records) > 1:
            records, held_out = records[:-1], records[-1:]
        seen = _examined([*records, *held_out], options.trust_log)
        records, held_out = seen[:len(records)], seen[len(records):]
        result = identify(records, held_out, [name for name in options.extra.split(",") if name])
    if options.json:
        print(to_json(as_dict(result)))
    else:
        show(result)
    if options.output:
        for path in save(result, options.output):
            print(f"wrote {path}", file=sys.stderr)
    return 0


def _examined(records: list[Record], trust_logs: bool) -> list[Record]:
    """Logs after the corrections that they prove; the first lines say them.

    Raises
    ------
    RecordError, NotIdentifiableError
        If the logs are not what they seem to be.

    """
    robot = records[0].robot
    if trust_logs or robot is None:
        return records
    seen = examine(records, robot)
    seen.raise_obstacles()
    for correction in seen.corrections:
        print(wrapped(f"Corrected in the logs: {correction}"), file=sys.stderr)
    return list(seen.records)


def show(result: Identification) -> None:
    """Print a table per joint, disagreements, predictions and warnings."""
    print(wrapped(f"Identified from {', '.join(result.sources)}"))
    for k in range(result.robot.n):
        print()
        _show_joint(result, k)
    print("\n".join(("", *_agreement(result))))
    if result.biases:
        print(wrapped(f"Without the extra terms: {'; '.join(map(_bias, result.biases))}."))
    for source in dict.fromkeys(p.source for p in result.predictions):
        print(f"\n{wrapped(f'Prediction of {source}, not used for the fit, rms errors:')}")
        _show_predictions(result, [p for p in result.predictions if p.source == source])
    for text in dict.fromkeys(result.warnings):
        print(wrapped(f"WARNING {text}"))


def save(result: Identification, folder: str) -> list[str]:
    """Write identification.json, and how CLIE converged as clie.png and clie.svg; their paths."""
    paths = [str(write(f"{folder}/identification.json", to_json(as_dict(result))))]
    if result.last_pass is None:
        return paths
    from clie_blocks.analysis.identification.plots import convergence_figure

    return [*paths, *save_figure(convergence_figure(
        result.last_pass, result.robot.joints, result.units["u"]), folder, "clie")]


def as_dict(result: Identification) -> dict[str, Any]:
    """Plain values for JSON."""
    return {
        "schema_version": SCHEMA_VERSION, "sources": result.sources,
        "joints": [{"name": name, "estimates": [
            {"method": e.method, "note": e.note, "terms": {
                term: {"value": e.get(term)[0] * result.scale[k],
                       "half_width": e.get(term)[1] * result.scale[k],
                       "unit": _unit(result, term)} for term in e.names}}
            for e in result.estimates[k]]} for k, name in enumerate(result.robot.joints)],
        "error_over_noise": result.error_over_noise,
        "disagreements": [vars(d) for d in result.disagreements],
        "predictions": [vars(p) for p in result.predictions],
        "biases": [vars(b) for b in result.biases],
        "warnings": list(dict.fromkeys(result.warnings))}


def _show_joint(result: Identification, k: int) -> None:
    estimates = result.estimates[k]
    names = max((e.names for e in estimates), key=len)
    head = [result.robot.joints[k], *(f"{term} [{_unit(result, term)}]" for term in names)]
    print_table(head, [[e.method, *(_cell(e, term, result.scale[k]) for term in names)]
                       for e in estimates])
    for note in dict.fromkeys(e.note for e in estimates if e.note):
        methods = ", ".join(e.method for e in estimates if e.note == note)
        print(wrapped(f"{methods}: {note}"))


def _cell(estimate: Estimate, term: str, scale: float) -> str:
    if term not in estimate.names:
        return "known"
    value, interval = (x * scale for x in estimate.get(term))
    return f"{value:.5g} +- {interval:.2g}" if np.isfinite(interval) else f"{value:.5g}"


def _unit(result: Identification, term: str) -> str:
    force = result.units["force"]
    if force == "N":
        return {"inertia": "kg", "viscous": "N s/m"}.get(term, "N")
    if force == "N m":
        return {"inertia": "kg m^2", "viscous": "N m s"}.get(term, "N m")
    return {"inertia": f"{force} s^2", "viscous": f"{force} s"}.get(term, force)


def _agreement(result: Identification) -> list[str]:
    """Two signs of a wrong structure: methods that differ, and an error above the noise."""
    lines = [wrapped(agreement(result.estimates))]
    if result.disagreements:
        lines = ["The methods disagree beyond their intervals:",
                 *(wrapped(str(difference), "  ") for difference in result.disagreements)]
    ratios = ", ".join(
        f"{name} {ratio:.3g}" for name, ratio in
        zip(result.robot.joints, result.error_over_noise, strict=True) if np.isfinite(ratio))
    if ratios:
        lines.append(wrapped("Error of the fitted loop over the noise of the position: "
                             f"{ratios}."))
    if ratios and (result.disagreements or np.nanmax(result.error_over_noise) > MISSING):
        lines.append("Something is missing in the model; 'clie diagnose' looks for it.")
    return lines


def _bias(b: Bias) -> str:
    return f"{b.joint} {b.term} {b.without:.5g} ({b.without / b.value - 1:+.1%})"


def _show_predictions(result: Identification, predictions: Sequence[Prediction]) -> None:
    q, u = result.units["q"], result.units["u"]
    print_table(
        ("", "method", f"position [{q}]", "of motion", f"noise [{q}]", f"input [{u}]",
         "of command"),
        [(name, p.method, f"{p.position_rms[k]:.3g}", f"{p.position_rms[k] / p.moved_rms[k]:.2%}",
          f"{p.noise[k]:.2g}", f"{p.input_rms[k]:.3g}", f"{p.input_rms[k] / p.command_rms[k]:.2%}")
         for p in predictions for k, name in enumerate(result.robot.joints)], "<<>>>>>")


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie identify", "Identify a recorded robot; of several logs the last is held out and "
        "predicted, unless --holdout names others.",
        output_help="write identification.json and how CLIE converged, clie.svg")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="file or folder")
    parser.add_argument("--robot", metavar="FILE", help="robot.toml; else the one with the log")
    add_reading_options(parser)
    parser.add_argument("--trust-log", action="store_true",
                        help="take the logs as they are: correct nothing, stop for nothing that "
                             "'clie check' finds")
    parser.add_argument("--holdout", nargs="+", default=[], metavar="LOG",
                        help="logs to predict only")
    parser.add_argument("--with", dest="extra", default="", metavar="TERMS",
                        help="further terms by comma: "
                        + "; ".join(f"{name} ({text})" for name, text in EXTRA.items()))
    return parser


if __name__ == "__main__":
    run_main(main)
