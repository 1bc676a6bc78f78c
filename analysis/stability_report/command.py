"""``clie bounds``: is this set of gains safe, and why; one report as HTML, Markdown and JSON."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from clie_blocks import paper
from clie_blocks.errors import ClieError
from clie_blocks.output import command_parser, print_table, progress, run_main, to_json, wrapped

if TYPE_CHECKING:
    from clie_blocks.analysis.stability_report.convergence_sweep import Convergence
    from clie_blocks.analysis.stability_report.linear_analysis import LinearAnalysis
    from clie_blocks.analysis.stability_report.quantities import Quantities
    from clie_blocks.analysis.stability_report.study import Study
    from clie_blocks.analysis.theory.bounds import Condition
    from clie_blocks.analysis.theory.excitation_level import Excitation


def as_dict(study: Study, quantities: Quantities) -> dict[str, Any]:
    """The quantities of a report as plain values for JSON."""
    b, joints = quantities.bounds, study.joints
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
        **_linear(quantities.linear),
        "convergence": _convergence(study, quantities.convergence),
        "excitation": quantities.excitation and _excitation(quantities.excitation.model)}


def _excitation(windows: list[Excitation]) -> list[dict[str, Any]]:
    return [{"window": one.window, "weighted": one.weighted, "smallest": one.smallest,
             "largest": one.largest, "condition_number": one.condition_number,
             "weakest": one.weakest_in_words} for one in windows]


def _condition(condition: Condition) -> dict[str, Any]:
    return {"holds": condition.holds, "per_joint": condition.per_joint,
            "margin": condition.margin, "smallest_kd": condition.smallest_kd,
            "largest_kp": condition.largest_kp}


def _linear(linear: LinearAnalysis) -> dict[str, Any]:
    return {
        "poles": {kind: [[p.real, p.imag] for p in poles.values]
                  for kind, poles in linear.poles.items()},
        "margins": {kind: [{"gain": one.gain, "smallest_gain": one.least_gain,
                            "phase_deg": one.phase, "crossover": one.crossover,
                            "delay_s": one.delay, "peak_sensitivity": one.peak_sensitivity}
                           for one in per_joint] for kind, per_joint in linear.margins.items()},
        "filters": {name: {"amplitude_error": curve.amplitude_error, "delay_s": curve.delay,
                           "noise_gain": linear.noise[name]}
                    for name, curve in linear.filters.items()}}


def _convergence(study: Study, convergence: Convergence) -> dict[str, Any]:
    (best_gamma, best), here = convergence.best, convergence.here
    return {"rate": here.per_joint, "time_constant_s": here.time_constant,
            "best_gamma": best_gamma, "best_time_constant_s": best.time_constant,
            "wanted_time_s": study.time, "gamma_for_wanted_time": convergence.gain_for(study.time),
            "over_alpha": {alpha: rates.slowest
                           for alpha, rates in convergence.over_alpha.items()},
            "gammas": convergence.gammas,
            "rates": [one.slowest for one in convergence.rates],
            "averaged": np.min(convergence.averaged, axis=1)}


def study_of(options: argparse.Namespace) -> Study:
    """The study that the options describe: the paper's robot, or that of ``--robot``."""
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


def parser() -> argparse.ArgumentParser:
    """Command-line options."""
    options = command_parser(
        "clie bounds", "Say whether PD gains are safe for identification, and why.",
        output="out/bounds",
        epilog="Exit codes: 0 safe, 1 not safe, and the report says what to change, "
               "2 usage, 3 bad data.")
    add = options.add_argument
    add("--robot", metavar="FILE", help="robot.toml; by default the paper's two-link arm")
    add("--kp", type=float, nargs="+", metavar="K",
        help="proportional gains [N m/rad], one for all joints or one each")
    add("--kd", type=float, nargs="+", metavar="K",
        help="derivative gains [N m s/rad], one for all joints or one each")
    add("--theta", type=float, nargs="+", metavar="T",
        help="parameters a, b, d of eq. (9), such as estimates, instead of the robot's")
    add("--time", type=float, default=100.0, metavar="S",
        help="wanted time [s] for estimates within 1 %%")
    add("--gamma", type=float, default=paper.GAMMA, metavar="G",
        help="adaptation gain")
    add("--balanced", action="store_true",
        help="diagonal Gamma, scaled so that all estimates converge alike (always with --robot)")
    add("--alpha", type=float, default=paper.ALPHA[2], metavar="A",
        help="gain of the gradient method")
    add("--eps-bar", type=float, metavar="E",
        help="bound on the modelling error [rad/s^2]; by default the paper's, or for a robot "
             "file the largest of a simulation")
    return options


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices: threads would only wait
def main(argv: list[str] | None = None) -> int:
    """Write the report and print its summary; 1 if the gains are not safe."""
    options = parser().parse_args(argv)
    from clie_blocks.analysis.report.document import BAD
    from clie_blocks.analysis.report.render import save_document
    from clie_blocks.analysis.stability_report.document import document, facts, verdict
    from clie_blocks.analysis.stability_report.quantities import PARTS, analyse

    study = study_of(options)
    with progress("analysing the loop", PARTS) as advance:
        quantities = analyse(study, advance)
    sentence, mood, advice = verdict(study, quantities)
    if not options.json:  # before the pictures, which take as long as the numbers
        print("\n".join((*map(wrapped, (sentence, *advice)), "")))
        print_table(("quantity", "value"), facts(study, quantities), "<<")
    with progress("drawing the report"):
        files = save_document(document(study, quantities), options.output, "stability")
    if options.json:
        print(to_json({**as_dict(study, quantities), "verdict": sentence, "advice": advice,
                       "files": files}))
    else:
        print(f"\nreport: {files[0]}")
    return 1 if mood == BAD else 0


if __name__ == "__main__":
    run_main(main)
