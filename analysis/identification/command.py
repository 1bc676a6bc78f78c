"""The command ``clie identify``: parameters of a recorded robot, every method in one table."""

import argparse

import numpy as np

from clie_blocks.analysis.identification import identify
from clie_blocks.analysis.identification.columns import EXTRA
from clie_blocks.analysis.records.read import read_records
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.output import run_main, to_json, write

SCHEMA_VERSION = 1
MISSING = 1.5  # times the noise; a larger error is not noise alone


def main(argv=None):
    """Identify a robot from logs; of several the last one is held out unless said otherwise.

    Parameters
    ----------
    argv : list of str, optional
        Arguments; by default those of the process.

    """
    options = _parser().parse_args(argv)
    robot = read_robot(options.robot) if options.robot else None
    records = _read(options.logs, robot)
    held_out = _read(options.holdout, robot)
    if not options.holdout and len(records) > 1:
        records, held_out = records[:-1], records[-1:]
    result = identify(records, held_out, [x for x in options.extra.split(",") if x])
    print(to_json(as_dict(result)) if options.json else as_text(result))
    if options.output:
        write(f"{options.output}/identification.json", to_json(as_dict(result)))
    return 0


def as_text(result):
    """Table per joint, disagreements, predictions, warnings."""
    lines = [f"Identified from {', '.join(result.sources)}"]
    for k, estimates in enumerate(result.estimates):
        lines += ["", *_table(result, k, estimates)]
    lines += ["", _agreement(result)]
    lines += [f"Without the extra terms: {'; '.join(_bias(b) for b in result.biases)}."
              ] if result.biases else []
    for p in result.predictions:
        lines += [f"Prediction of {p.source} (not used), {p.method}:",
                  *(_predicted(result, p, k) for k in range(result.robot.n))]
    return "\n".join([*lines, *(f"WARNING {text}" for text in dict.fromkeys(result.warnings))])


def as_dict(result):
    """Plain values for JSON."""
    return {
        "schema_version": SCHEMA_VERSION, "sources": result.sources,
        "joints": [{"name": name, "estimates": [
            {"method": e.method, "note": e.note, "terms": {
                term: {"value": e.get(term)[0] * result.scale[k],
                       "half_width": e.get(term)[1] * result.scale[k],
                       "unit": _unit(result.robot, term)} for term in e.names}}
            for e in result.estimates[k]]} for k, name in enumerate(result.robot.joints)],
        "error_over_noise": result.leftover,
        "disagreements": [vars(d) for d in result.disagreements],
        "predictions": [vars(p) for p in result.predictions],
        "biases": [vars(b) for b in result.biases],
        "warnings": list(dict.fromkeys(result.warnings))}


def _table(result, k, estimates):
    names = max((e.names for e in estimates), key=len)
    width = max(len(e.method) for e in estimates)
    heads = [f"{term} [{_unit(result.robot, term)}]" for term in names]
    yield f"{result.robot.joints[k]:{width}}  " + "  ".join(f"{head:>24}" for head in heads)
    for estimate in estimates:
        cells = [_cell(estimate, term, result.scale[k]) for term in names]
        note = f"  {estimate.note}" if estimate.note else ""
        yield f"{estimate.method:{width}}  " + "  ".join(f"{x:>24}" for x in cells) + note


def _cell(estimate, term, scale):
    if term not in estimate.names:
        return "given"
    value, interval = (x * scale for x in estimate.get(term))
    return f"{value:.5g} +- {interval:.2g}" if np.isfinite(interval) else f"{value:.5g}"


def _unit(robot, term):
    sliding = robot.units.get("q") == "m"
    force = "N" if sliding else "N m"
    if robot.motor.torque_gain is None:
        force = robot.units.get("u", "N m")
    if force == "N":
        return {"inertia": "kg", "viscous": "N s/m"}.get(term, "N")
    if force == "N m":
        return {"inertia": "kg m^2", "viscous": "N m s"}.get(term, "N m")
    return {"inertia": f"{force} s^2", "viscous": f"{force} s"}.get(term, force)


def _agreement(result):
    """Two signs of a wrong structure: methods that differ, and an error above the noise."""
    listed = "".join(f"\n  {d}" for d in result.disagreements)
    said = (f"The methods disagree beyond their intervals:{listed}\n" if listed else
            "The methods agree within their intervals.\n")
    left = ", ".join(f"{name} {left:.3g}" for name, left in
                     zip(result.robot.joints, result.leftover, strict=True) if np.isfinite(left))
    if not left:
        return said.rstrip()
    said += f"Error of the fitted loop over the position's noise: {left}."
    if listed or np.nanmax(result.leftover) > MISSING:
        said += " The model lacks something; 'clie diagnose' looks for it."
    return said


def _bias(b):
    return f"{b.joint} {b.term} {b.without:.5g} ({b.without / b.value - 1:+.1%})"


def _predicted(result, p, k):
    q, u = result.robot.units.get("q", "rad"), result.robot.units.get("u", "N m")
    return (f"  {result.robot.joints[k]}: position {p.position_rms[k]:.3g} {q} rms "
            f"({p.position_rms[k] / p.moved_rms[k]:.2%} of the motion, noise {p.noise[k]:.2g}), "
            f"input error {p.input_rms[k]:.3g} {u} rms ({p.input_rms[k] / p.command_rms[k]:.2%} "
            "of the command)")


def _read(paths, robot):
    return [record for path in paths for record in read_records(path, robot)]


def _parser():
    parser = argparse.ArgumentParser(
        prog="clie identify", description="Identify a recorded robot; of several logs the last is "
        "held out and predicted, unless --holdout names others.")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="file or folder")
    parser.add_argument("--robot", metavar="FILE", help="robot.toml; else the one beside the log")
    parser.add_argument("--holdout", nargs="+", default=[], metavar="LOG",
                        help="logs to predict only")
    parser.add_argument("--with", dest="extra", default="", metavar="TERMS",
                        help="further terms by comma: "
                        + "; ".join(f"{name} ({text})" for name, text in EXTRA.items()))
    parser.add_argument("--json", action="store_true", help="print JSON with schema_version")
    parser.add_argument("-o", dest="output", metavar="DIR", help="write identification.json")
    return parser


if __name__ == "__main__":
    run_main(main)
