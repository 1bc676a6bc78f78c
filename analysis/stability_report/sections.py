"""The sections of a stability report: sentences, tables and pictures."""

from collections.abc import Iterable

import numpy as np

from clie_blocks import paper
from clie_blocks.analysis.report.document import BAD, GOOD, Picture, Section, Table
from clie_blocks.analysis.stability_report import plots
from clie_blocks.analysis.stability_report.convergence_sweep import Convergence
from clie_blocks.analysis.stability_report.excitation_windows import ExcitationReport
from clie_blocks.analysis.stability_report.linear_analysis import LinearAnalysis
from clie_blocks.analysis.stability_report.loop_bounds import Bounds
from clie_blocks.analysis.stability_report.plots import NORM
from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    condition,
    theorem_2,
    ultimate_bound,
)
from clie_blocks.analysis.theory.frequency import PAPER_TONES

DIVERGED = ("The simulated identification diverged within 400 s: it is unstable, or too stiff for "
            "steps of 1 ms.")
NORM_F = "[rad, rad/s, rad/s^2]"  # with the filtered error of (45), a third
KINDS = {"exact": "exact velocity", "G1": "velocity through G1"}


def condition_section(study: Study, b: Bounds) -> Section:
    """The condition of the theorems, joint by joint, and the gain plane."""
    joints, worst = study.joints, b.worst.condition
    rows = [(f"joint {k + 1}", number(b.condition.per_joint[k]), number(worst.per_joint[k]),
             number(joints.kd[k]), number(b.condition.smallest_kd[k]),
             number(worst.smallest_kd[k]), number(joints.kp[k]),
             number(b.condition.largest_kp[k]), number(worst.largest_kp[k]))
            for k in range(joints.n)]
    marks = tuple(GOOD if value > 0 else BAD for value in worst.per_joint)
    table = Table(("joint", "K_bar", "worst", "Kd", "smallest Kd", "worst", "Kp", "largest Kp",
                   "worst"), tuple(rows), "Gains in N m/rad and N m s/rad", marks)
    box = Table(("parameter", "nominal", "from", "to"), tuple(
        (f"{'abd'[p // joints.n]}{p % joints.n + 1}", number(joints.theta[p]),
         number(study.box.lower[p]), number(study.box.upper[p]))
        for p in range(3 * joints.n)), "Parameters of eq. (9) and the box of the worst case")
    estimates = (_with_estimates(joints, b.ultimate.eta_norm),) if study.is_paper else ()
    return Section("The condition Kp^-1 Kd A_bar - I > 0", (
        "It makes V (A.1) a Lyapunov function of the identification loop, Theorems 1 to 4. It "
        "rises with A and B, so that its worst case over the box is exact and lies at the corner "
        "of the smallest A and B.",), (), (table, box, *estimates), (
        Picture("gain_plane", plots.gain_plane(joints, study.box),
                "Gain plane: green is safe for all parameters of the box."),))


def _with_estimates(joints: ControlledJoints, eta_norm: float) -> Table:
    """The bounds by the paper's estimates instead of its real values."""
    rows = []
    for name, theta in (("these parameters", joints.theta),
                        *((f"estimates, CASE {case}", hat)
                          for case, hat in paper.THETA_HAT.items())):
        other = ControlledJoints.from_theta(theta, joints.kp, joints.kd)
        rows.append((name, *map(number, (
            condition(other).margin, theorem_2(other, 0.0).k_1,
            ultimate_bound(other, eta_norm).mu_0))))
    return Table(("parameters", "smallest K_bar", "k_1", f"mu_0 {NORM}"), tuple(rows),
                 "With the estimates of Table 2 instead of the real values")


def pd_bound_section(study: Study, b: Bounds) -> Section:
    """mu_0 with its ingredients, and the set that is invariant."""
    low, high = b.worst.mu_0
    printed = _printed_mu_0(study)
    rows = (("bound on ||eta|| = ||B PE - D|| [rad/s^2]", number(b.ultimate.eta_norm),
             f"largest value {b.eta_computed:.6g} at {b.eta_instant:.4g} s",
             number(paper.ETA_NORM) if study.is_paper else "-"),
            ("smallest eigenvalue of script A", number(b.ultimate.lambda_min_a), "(17)", "-"),
            ("norm of script B", number(b.ultimate.norm_b), "(17)", "-"),
            (f"mu_0 {NORM}", number(b.ultimate.mu_0), "(18)", printed),
            (f"mu_0 {NORM}, worst over the box", f"{low:.4g} to {high:.4g}",
             "the worst lies between these", "-"),
            (f"radius of the level set of V (14) {NORM}", number(b.ultimate.invariant.outer),
             f"{b.ultimate.invariant.blow_up:.3g} times mu_0", "-"),
            (f"simulated radius after 20 s {NORM}", number(b.radius),
             DIVERGED if b.trajectory is None else
             f"mu_0 is {b.ultimate.mu_0 / b.radius:.3g} times as large", "-"))
    return Section("Ultimate bound of the PD loop: mu_0", (
        "Outside the ball of radius mu_0 the function V (14) falls. The ball itself is not "
        f"invariant: the invariant set is the level set V <= {b.ultimate.invariant.level:.4g} "
        "that contains it, and the ball around that set is the valid bound.",), (),
        (Table(("quantity", "value", "remark", "printed"), rows),),
        () if b.trajectory is None else (
            Picture("phase_plane", plots.phase_plane(b.trajectory, b.ultimate),
                    "The mu_0 circle around the simulated motion (quarter plane of norms)."),))


def _printed_mu_0(study: Study) -> str:
    gains = float(study.joints.kp[0]), float(study.joints.kd[0])
    same = np.all(study.joints.kp == gains[0]) and np.all(study.joints.kd == gains[1])
    known = study.is_paper and same and gains in paper.MU_0
    return f"{paper.MU_0[gains]:.4f}" if known else "-"


def identification_section(study: Study, b: Bounds) -> Section:
    """Constants of Theorems 2 and 4, and the simulated errors."""
    second, fourth, measured = b.second, b.fourth, b.measured
    rows = (
        ("k_1", number(second.k_1), number(second.k_1_printed),
         "printed without the -I of K_bar"),
        ("k_2", number(second.k_2), number(second.k_2), ""),
        (f"mu_1 {NORM}", number(second.mu_1), number(second.mu_1_printed),
         f"for eps_bar = {b.eps_bar[0]:.3g} rad/s^2"),
        ("rho", number(second.rho), number(second.k_1_printed - second.threshold),
         "(31) only says mu_1 < 1"),
        ("k_3", number(fourth.k_3), number(fourth.k_3_printed),
         f"the proof needs the minimum with alpha = {study.alpha:g}"),
        ("k_4", number(fourth.k_4), number(fourth.k_4), ""),
        (f"mu_2 {NORM_F}", number(fourth.mu_2), number(fourth.mu_2_printed),
         f"(A.12) for eps_bar = {b.eps_bar[1]:.3g} rad/s^2; the text of the theorem "
         "has another formula"),
        ("varrho", number(fourth.varrho), number(fourth.k_3_printed - fourth.threshold),
         "(46) holds" if fourth.holds else "(46) fails with the minimum"))
    run = (("largest modelling error after 5 s [rad/s^2]", number(measured["eps"]), "-"),
           (f"||E|| after 5 s {NORM}", number(measured["e_early"]), number(measured["mu_1"])),
           (f"||E|| in the last 20 s of 400 s {NORM}", number(measured["e_late"]),
            number(measured["mu_1"])),
           (f"||(E, e_f)|| in the last 20 s {NORM_F}", number(measured["sigma_late"]),
            number(measured["mu_2"])))
    remark = (DIVERGED if b.errors is None else "In the simulation mu_1 is "
              f"{measured['mu_1'] / max(measured['e_late'], 1e-300):.3g} times the error that "
              "remains.")
    return Section("Ultimate bounds of the identification error: mu_1, mu_2", (
        "mu_1 and mu_2 are radii outside which V (A.1) falls. V also holds the parametric error, "
        "so that E may exceed them while the estimates converge: no bound on E follows from them "
        f"alone. {remark}",), (), (
        Table(("constant", "as it follows", "as printed", "difference"), rows),
        Table(("simulated", "value", "mu_1 or mu_2 with it"), run,
              f"Gamma = {study.gamma:g}; update law (27), and (40) with alpha = {study.alpha:g} "
              "for the last row")),
        () if b.errors is None else (
            Picture("identification_error", plots.errors_plot(b),
                    "Identification error against mu_1, and the modelling error behind it."),))


def linear_section(study: Study, linear: LinearAnalysis) -> Section:
    """Filters, poles and margins."""
    tones = PAPER_TONES
    filters = tuple(
        (name, *(f"{100 * error:+.4f} %" for error in curve.amplitude_error),
         f"{1e3 * curve.delay[0]:.3g}", number(linear.noise[name]))
        for name, curve in linear.filters.items())
    rows = []
    for kind, label in KINDS.items():
        for k, one in enumerate(linear.margins[kind]):
            rows.append((f"joint {k + 1}, {label}", number(one.gain), number(one.least_gain),
                         f"{one.phase:.2f}", number(one.crossover), f"{1e3 * one.delay:.4g}",
                         number(one.peak_sensitivity)))
    lost = [bare.phase - lag.phase for bare, lag in zip(linear.margins["exact"],
                                                        linear.margins["G1"])]
    poles = tuple((KINDS[kind], _poles(one.values), number(float(np.min(one.damping))))
                  for kind, one in linear.poles.items())
    return Section("Frequency responses, poles, margins", (
        "All from linearised diagrams. The lag of G1 costs at most "
        f"{max(lost):.3g} degrees of phase margin.",), (), (
        Table(("filter", *(f"amplitude error at {tone:g} Hz" for tone in tones), "lag [ms]",
               "noise gain (1 ms)"), filters, "G1: velocity, noise gain in 1/s; G2: low-pass"),
        Table(("loop at the plant input", "gain margin", "smallest gain", "phase margin [deg]",
               "crossover [rad/s]", "delay margin [ms]", "peak of |S|"), tuple(rows)),
        Table(("PD loop", "poles [rad/s]", "smallest damping"), poles)), (
        Picture("filters", plots.filter_bode(), "Bode plots of G1 and G2; dots are the tones of "
                "the excitation, with the amplitude error there."),
        Picture("loop", plots.loop_plots(linear.margins), "Loop, sensitivity and complementary "
                "sensitivity with and without G1."),
        Picture("poles", plots.pole_map(study), "Poles while both gains are scaled together.")))


def _poles(values: np.ndarray) -> str:
    return ", ".join(f"{p.real:.4g}" + (f"{p.imag:+.3g}j" if abs(p.imag) > 1e-6 else "")
                     for p in values)


def convergence_section(study: Study, sweep: Convergence) -> Section:
    """Predicted rates over Gamma and alpha."""
    best_gamma, best = sweep.best
    wanted = sweep.gain_for(study.time)
    reach = (f"the smallest gain tried that leaves 1 % after {study.time:g} s is {wanted:.3g}"
             if wanted else f"no gain leaves 1 % after {study.time:g} s")
    plain = sweep.over_alpha[0.0].slowest
    alphas = tuple((f"{alpha:g}", *(number(rate) for rate in rates.per_joint),
                    f"{100 * (rates.slowest / plain - 1):+.2g} %")
                   for alpha, rates in sweep.over_alpha.items())
    slower = "; more is slower again" if best_gamma < sweep.gammas[-1] else ""
    rows = tuple((f"{gamma:.4g}", number(rates.slowest), f"{rates.time_constant:.4g}",
                  f"{rates.time_to(0.01):.4g}", number(float(np.min(averaged))))
                 for gamma, rates, averaged in list(zip(sweep.gammas, sweep.rates,
                                                        sweep.averaged))[::2])
    return Section("How fast the estimates converge", (
        f"Gamma = {study.gamma:g}: the slowest error has a time constant of "
        f"{sweep.here.time_constant:.3g} s and is down to 1 % after "
        f"{sweep.here.time_to(0.01):.3g} s. The fastest of the gains tried is "
        f"{best_gamma:.3g} with {best.time_constant:.3g} s{slower}; {reach}. "
        "Averaging is right for small gains only.",),
        (), (Table(("Gamma", "slowest rate [1/s]", "time constant [s]", "to 1 % [s]",
                    "averaged rate [1/s]"), rows),
             Table(("alpha", *(f"joint {k + 1} [1/s]" for k in range(study.joints.n)), "change"),
                   alphas, f"Composite law (40) at Gamma = {study.gamma:g}")), (
            Picture("rates", plots.rates_plot(sweep, study.gamma),
                    "Predicted rate over the adaptation gain: Floquet exponents of the "
                    "linearised periodic loop, and averaging."),))


def excitation_section(report: ExcitationReport | None) -> Section:
    """Excitation per window, and a multisine that does better."""
    if report is None:
        return Section("Excitation", (DIVERGED,))
    rows = tuple((f"{one.window[0]:g}-{one.window[1]:g} s", number(one.weighted),
                  number(one.smallest), number(one.largest), number(one.condition_number),
                  one.weakest_in_words, number(other.smallest), number(other.condition_number))
                 for one, other in zip(report.model, report.filtered))
    designs = tuple(
        (f"joint {k + 1}", ", ".join(f"{f:.3g}" for f in design.frequency),
         ", ".join(f"{a:.3g}" for a in design.amplitude), number(report.per_second[k]),
         number(design.smallest), f"{design.smallest / max(report.per_second[k], 1e-300):.2f}")
        for k, design in enumerate(report.designs))
    return Section("Excitation", (
        "The scalar (49) may be positive without any excitation; the smallest eigenvalue of the "
        "matrix in (28) and (42) decides.",), (), (
        Table(("window", "(49)", "smallest of (28)", "largest", "condition", "least excited",
               "smallest of (42)", "condition"), rows),
        Table(("joint", "tones [Hz]", "amplitudes [N m]", "now", "designed", "factor"), designs,
              "A multisine that reaches the same position, velocity and torque at most; smallest "
              "eigenvalue per second")))


def number(value: float) -> str:
    """Five significant digits."""
    return f"{value:.5g}"


def join_values(values: Iterable[float]) -> str:
    """Values with commas."""
    return ", ".join(f"{value:g}" for value in values)
