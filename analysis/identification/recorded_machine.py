"""CLIE on the log of a real machine, beside its published values where they are known."""

import argparse
from pathlib import Path

import numpy as np

from clie_blocks.analysis.identification.recorded_clie import RecordedLoop
from clie_blocks.analysis.records import read_records
from clie_blocks.errors import ClieError, RecordError
from clie_blocks.output import save_figure, to_json

# Janot, Gautier, Brunot 2019, as published with the benchmark.
EMPS_PUBLISHED = {"mass": 95.1089, "viscous": 203.5034, "offset": -3.1648, "coulomb": 20.3935}
EMPS_HELP = ("No data there. The EMPS benchmark (Janot, Gautier, Brunot 2019) is published at "
             "nonlinearbenchmark.org/benchmarks/emps: unpack DATA_EMPS.mat and "
             "DATA_EMPS_PULSES.mat into a folder and name it")


def identify(folder, passes):
    """Identify the machine of a folder of logs: fit on the first, test on the others.

    Parameters
    ----------
    folder : path-like
        The logs.
    passes : int
        Passes over the first log.

    Returns
    -------
    result : dict
        The numbers, ready for JSON.
    loop : RecordedLoop
        The loop of the log used.
    run : RecordedRun
        Its last pass.

    Raises
    ------
    RecordError
        If there is no log.

    """
    if not Path(folder).exists():
        raise RecordError(f"{folder}: {EMPS_HELP}")
    records = read_records(folder)
    loop = RecordedLoop(records[0])
    run = loop.identify(passes)
    theta = run.theta_hat
    n = records[0].n
    a, b, _ = theta.reshape(3, n)
    margin = loop.kd / loop.kp * (a + b * loop.kd) - 1
    return {
        "schema_version": 1, "log": records[0].source, "passes": passes,
        "theta_hat": theta, "last_change": run.changes[-1],
        "physical": physical(records[0], theta), "unit_of_u": _unit(records[0]),
        "input_error_rms": rms(loop.input_error(theta)),
        "held_out": [{"log": other.source,
                      "input_error_rms": rms(RecordedLoop(other).input_error(theta))}
                     for other in records[1:]],
        "condition": {"holds": bool(np.all(margin > 0)), "per_joint": margin},
    }, loop, run


def physical(record, theta):
    """Estimates as inertia, viscous friction and constant load in the unit of force or torque.

    Parameters
    ----------
    record : clie_blocks.analysis.records.Record
        The log; its motor's torque gain turns u into a force or torque.
    theta : ndarray, shape (3n,)
        Estimates ``[a, b, d]``.

    """
    gain = record.robot.motor.torque_gain
    gain = np.ones(record.n) if gain is None else gain
    a, b, d = np.reshape(theta, (3, record.n))
    return {"mass": gain / b, "viscous": gain * a / b, "offset": gain * d / b}


def _unit(record):
    return np.atleast_1d(record.units["u"])[0]


def rms(rows):
    """Root mean square of each row."""
    return np.sqrt(np.mean(np.square(rows), axis=1))


def main(argv=None):
    """Identify a recorded machine and print what CLIE makes of it.

    Parameters
    ----------
    argv : list of str, optional
        Command-line arguments; by default those of the process.

    Returns
    -------
    int
        0; errors carry their own codes.

    """
    options = _parser().parse_args(argv)
    if options.passes < 1:
        raise ClieError(f"--passes must be at least 1, got {options.passes}")
    result, loop, run = identify(options.logs, options.passes)
    result["files"] = save_figure(_figure(loop, run), options.output, "recorded_loop")
    if options.json:
        print(to_json(result))
    else:
        print("\n".join(_summary(result, emps="EMPS" in loop.record.robot.name)))
    return 0


def _parser():
    options = argparse.ArgumentParser(
        prog="recorded_loop.py", formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        description="Run Fig. 2 with a recorded machine in the place of plant and PD.")
    options.add_argument("logs", help="folder of logs (the first is fitted, the others are held "
                                      "out), such as the unpacked EMPS benchmark")
    options.add_argument("--passes", type=int, default=20,
                         help="passes over the log; the estimates carry over")
    options.add_argument("--json", action="store_true", help="print one JSON object")
    options.add_argument("-o", "--output", default="out/recorded_loop", metavar="DIR",
                         help="folder for the plot")
    return options


def _summary(result, emps):
    yield f"CLIE (27) on {result['log']}, {result['passes']} passes, last change "\
          f"{result['last_change']:.1e}"
    units = ("kg", "N/(m/s)", "N") if emps else ("kg m^2", "N m s", "N m")
    for (key, values), unit in zip(result["physical"].items(), units):
        joints = "  ".join(f"{value:9.3f}" for value in values)
        published = f"   published {EMPS_PUBLISHED[key]:9.3f}" if emps else ""
        yield f"  {key:8} {joints} {unit:8}{published}".rstrip()
    unit = result["unit_of_u"]
    yield f"  input error, rms: {_numbers(result['input_error_rms'])} {unit} on this log"
    for other in result["held_out"]:
        yield (f"  input error, rms: {_numbers(other['input_error_rms'])} {unit} on "
               f"{other['log']} (not used)")
    condition = result["condition"]
    yield (f"  Kp^-1 Kd A_bar - I = {_numbers(condition['per_joint'])}: "
           + ("positive, Theorem 1 applies" if condition["holds"] else
              "negative, so the sufficient condition of Theorem 1 is violated by that much; the "
              "estimates converge here all the same, without the paper's guarantee"))
    if emps:
        excess = result["physical"]["viscous"][0] / EMPS_PUBLISHED["viscous"]
        yield ("  Missing in this model: Coulomb friction, "
               f"{EMPS_PUBLISHED['coulomb']:.1f} N as published. It is the limit of this model: "
               f"the viscous term has taken it up and is {excess:.1f} times the published one.")


def _numbers(values):
    return " ".join(f"{value:.4g}" for value in np.atleast_1d(values))


def _figure(loop, run):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    time = np.arange(run.e_u.shape[1]) * loop.period
    unit = _unit(loop.record)
    for k, name in enumerate(loop.record.joints):
        above.plot(time, loop.record.u[:, k], lw=0.8, label=f"recorded u, {name}")
        above.plot(time, run.e_u[k], lw=0.8, label=f"input error, {name}")
    settled = run.history / run.theta_hat[:, None]
    for row, key in zip(settled, [f"{p}_hat {j}" for p in "abd" for j in loop.record.joints]):
        below.plot(time, row, lw=0.8, label=key)
    above.set_ylabel(f"input [{unit}]")
    below.set(xlabel="time [s]", ylabel="estimate over its mean [1]", ylim=(0, 2))
    for ax in (above, below):
        ax.grid(alpha=0.3)
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=6, frameon=False, fontsize=8)
    figure.suptitle("CLIE on a recorded machine, last pass")
    return figure
