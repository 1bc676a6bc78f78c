"""``clie bounds``: is this set of gains safe, and why; one report as HTML, Markdown and JSON."""

import argparse
from dataclasses import replace

import numpy as np

from clie_blocks import paper
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, run_main, to_json


def analyse(study, advance=lambda part: None):
    """Compute everything that the report says.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.
    advance : callable
        Told after each of the four parts.

    Returns
    -------
    dict
        ``bounds``, ``linear``, ``convergence``, ``excitation``.

    """
    from clie_blocks.analysis.stability_report import quantities as numbers

    parts = {"bounds": numbers.bounds_of, "linear": numbers.linear_analysis_of,
             "convergence": numbers.convergence_of, "excitation": numbers.excitation_of}
    found = {}
    for name, compute in parts.items():
        found[name] = compute(study)
        advance(1)
    return found


def as_dict(study, found):
    """Return the numbers of a report as plain values for JSON.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.
    found : dict
        See `analyse`.

    """
    b, joints = found["bounds"], study.joints
    condition, second, fourth = b.condition, b.second, b.fourth
    return {
        "schema_version": 1, "robot": study.name, "kp": joints.kp, "kd": joints.kd,
        "gamma": study.gamma, "gamma_diagonal": study.gamma_diagonal, "alpha": study.alpha,
        "a": joints.a, "b": joints.b, "d": joints.d,
        "eta": b.ultimate.eta_norm, "eta_computed": b.eta_computed, "mu_0": b.ultimate.mu_0,
        "mu_0_invariant": b.ultimate.invariant.outer, "blow_up": b.ultimate.invariant.blow_up,
        "eps_bar": b.eps_bar, "k_1": second.k_1, "k_1_printed": second.k_1_printed,
        "k_2": second.k_2, "mu_1": second.mu_1, "mu_1_printed": second.mu_1_printed,
        "rho": second.rho, "k_3": fourth.k_3, "k_3_printed": fourth.k_3_printed,
        "k_4": fourth.k_4, "mu_2": fourth.mu_2, "mu_2_printed": fourth.mu_2_printed,
        "varrho": fourth.varrho, "condition_46_holds": fourth.holds,
        "condition": _condition(condition),
        "worst_case": {"condition": _condition(b.worst.condition), "eta": b.worst.eta_norm,
                       "mu_0_from": b.worst.mu_0[0], "mu_0_to": b.worst.mu_0[1],
                       "k_1": b.worst.theorem_2.k_1, "lower": study.box.lower,
                       "upper": study.box.upper},
        "simulated": {"pd_radius": b.radius, **b.measured},
        **_linear(found["linear"]), "convergence": _convergence(study, found["convergence"]),
        "excitation": found["excitation"] and _excitation(found["excitation"].model)}


def _excitation(windows):
    return [{"window": one.window, "weighted": one.weighted, "smallest": one.smallest,
             "largest": one.largest, "condition_number": one.condition_number,
             "weakest": one.weakest_in_words} for one in windows]


def _condition(condition):
    return {"holds": condition.holds, "per_joint": condition.per_joint,
            "margin": condition.margin, "smallest_kd": condition.smallest_kd,
            "largest_kp": condition.largest_kp}


def _linear(linear):
    return {
        "poles": {kind: [[p.real, p.imag] for p in found.values]
                  for kind, found in linear.poles.items()},
        "margins": {kind: [{"gain": one.gain, "smallest_gain": one.least_gain,
                            "phase_deg": one.phase, "crossover": one.crossover,
                            "delay_s": one.delay, "peak_sensitivity": one.peak_sensitivity}
                           for one in found] for kind, found in linear.margins.items()},
        "filters": {name: {"amplitude_error": found.amplitude_error, "delay_s": found.delay,
                           "noise_gain": linear.noise[name]}
                    for name, found in linear.filters.items()}}


def _convergence(study, found):
    best_gamma, best = found.best
    return {"rate": found.here.per_joint, "time_constant_s": found.here.time_constant,
            "best_gamma": best_gamma, "best_time_constant_s": best.time_constant,
            "wanted_time_s": study.time, "gamma_for_wanted_time": found.gain_for(study.time),
            "over_alpha": {alpha: rates.slowest for alpha, rates in found.over_alpha.items()},
            "gammas": found.gammas,
            "rates": [one.slowest for one in found.rates],
            "averaged": np.min(found.averaged, axis=1)}


def study_of(options):
    """Return the study that the options ask for.

    Parameters
    ----------
    options : argparse.Namespace
        See `parser`.

    Returns
    -------
    Study
        The paper's robot, or that of ``--robot``.

    """
    from clie_blocks.analysis.stability_report.study import paper_study, robot_study

    if options.robot is None:
        study = paper_study().with_gains(options.kp, options.kd)
    else:
        from clie_blocks.analysis.records import read_robot

        study = robot_study(read_robot(options.robot), options.kp, options.kd)
    if options.theta is not None:
        study = study.with_theta(options.theta)
    if options.balanced and options.robot is None:
        study = study.balanced()
    for name in ("gamma", "alpha", "time"):
        if not getattr(options, name) > 0:
            raise ClieError(f"--{name} must be positive, got {getattr(options, name)}")
    if options.eps_bar is not None:
        if not options.eps_bar >= 0:
            raise ClieError(f"--eps-bar must not be negative, got {options.eps_bar}")
        study = replace(study, eps_bar=(options.eps_bar,) * 2)
    return replace(study, gamma=options.gamma, alpha=options.alpha, time=options.time)


def parser():
    """Return the command-line options."""
    options = argparse.ArgumentParser(
        prog="clie bounds",
        description="Is this set of PD gains safe for identification, and why.",
        epilog="Exit code 1: the gains are not safe, and the report says what to change.")
    add = options.add_argument
    add("--robot", metavar="FILE", help="robot.toml; by default the paper's two-link arm")
    add("--kp", type=float, nargs="+", metavar="KP",
        help="proportional gains [N m/rad], one for all joints or one each")
    add("--kd", type=float, nargs="+", metavar="KD", help="derivative gains [N m s/rad]")
    add("--theta", type=float, nargs="+", metavar="T",
        help="parameters a, b, d of eq. (9), such as estimates, instead of the robot's")
    add("--time", type=float, default=100.0,
        help="wanted time [s] for estimates within 1 %% (default: %(default)s)")
    add("--gamma", type=float, default=paper.GAMMA,
        help="adaptation gain (default: %(default)s)")
    add("--balanced", action="store_true",
        help="diagonal Gamma, scaled so that all estimates converge alike (always with --robot)")
    add("--alpha", type=float, default=paper.ALPHA[2],
        help="gain of the gradient method (default: %(default)s)")
    add("--eps-bar", type=float, metavar="E",
        help="bound on the modelling error [rad/s^2]; by default the paper's, or for a robot "
             "file the largest of a simulation")
    add("--json", action="store_true", help="print one JSON object")
    add("-o", "--output", metavar="DIR", default="out/bounds",
        help="folder for the report (default: %(default)s)")
    return options


def main(argv=None):
    """Write the report and print its summary.

    Parameters
    ----------
    argv : list of str, optional
        Command-line arguments; by default those of the process.

    Returns
    -------
    int
        0 if the gains are safe, 1 if not.

    """
    options = parser().parse_args(argv)
    from clie_blocks.analysis.report.document import BAD
    from clie_blocks.analysis.report.render import save_document
    from clie_blocks.analysis.stability_report.document import document, verdict

    study = study_of(options)
    with progress("analysing the loop", 5) as advance:
        found = analyse(study, advance)
        report = document(study, found)
        files = save_document(report, options.output, "stability")
        advance(1)
    sentence, mood, advice = verdict(study, found)
    numbers = as_dict(study, found)
    if options.json:
        print(to_json({**numbers, "verdict": sentence, "advice": advice, "files": files}))
    else:
        print("\n".join((sentence, *advice, *summary(report), f"report: {files[0]}")))
    return 1 if mood == BAD else 0


def summary(report):
    """Yield the facts of a report, one per line.

    Parameters
    ----------
    report : Document
        The report.

    """
    for name, value in report.facts:
        yield f"  {name:26} {value}"


if __name__ == "__main__":
    run_main(main)
