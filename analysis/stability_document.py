"""The stability report as a document: verdict first, then each condition with its numbers."""

import numpy as np

from clie_blocks import paper
from clie_blocks.analysis import stability_plots as plots
from clie_blocks.analysis.bounds import (
    ControlledJoints,
    condition,
    theorem_2,
    ultimate_bound,
)
from clie_blocks.analysis.frequency import PAPER_TONES
from clie_blocks.analysis.paper_results import errata_section
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Document,
    Picture,
    Section,
    Table,
)

DIVERGED = ("The simulated identification left all numbers within 400 s: it is unstable, or too "
            "stiff for steps of 1 ms.")
KINDS = {"exact": "exact velocity", "G1": "velocity through G1"}


def document(study, found):
    """Arrange the numbers of a study.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.
    found : dict
        ``bounds``, ``linear``, ``convergence``, ``excitation``, see
        `clie_blocks.analysis.stability_numbers`.

    Returns
    -------
    Document
        Ready to be written.

    """
    sentence, mood, advice = verdict(study, found)
    b, joints = found["bounds"], study.joints
    facts = (("smallest margin of K_bar", _number(b.condition.margin)),
             ("mu_0", _number(b.ultimate.mu_0)),
             ("radius that holds", _number(b.ultimate.invariant.outer)),
             ("simulated radius", _number(b.radius)),
             ("slowest estimate", f"{found['convergence'].here.time_constant:.3g} s"),
             ("Kp; Kd", f"{_list(joints.kp)}; {_list(joints.kd)}"))
    sections = [
        Section("What to do" if advice else "What was assumed", (), (*advice, *study.remarks)),
        _condition(study, b), _pd_bound(study, b), _identification(study, b),
        _linear(study, found["linear"]), _convergence(study, found["convergence"]),
        _excitation(found["excitation"])]
    if study.is_paper:
        sections.append(errata_section())
    return Document(f"Stability of {study.name}", sentence, mood, tuple(sections), facts)


def verdict(study, found):
    """Say whether the gains are safe, and if not what to change.

    Parameters
    ----------
    study : Study
        Robot and gains.
    found : dict
        As in `document`.

    Returns
    -------
    sentence : str
        The answer.
    mood : str
        ``'good'``, ``'unsure'`` (nominally, not over the whole box) or ``'bad'``.
    advice : tuple of str
        What to change, joint by joint.

    """
    b, poles = found["bounds"], found["linear"].poles
    advice = _advice(study, b.condition, "") if not b.condition.holds else ()
    if not poles["G1"].stable:
        return ("Unstable: with velocity through G1 the PD loop itself has poles in the right "
                "half-plane.", BAD, (*advice, _lower(found["linear"])))
    if advice:
        return (f"Not safe: K_bar = Kp^-1 Kd A_bar - I is {b.condition.margin:.3g}, not positive, "
                f"so that the identification loop has no proof of stability; {_indeed(found)}.",
                BAD, advice)
    if not b.worst.condition.holds:
        return (f"Safe for the nominal parameters (margin {b.condition.margin:.3g}), but not for "
                f"all that are possible (margin {b.worst.condition.margin:.3g}).", UNSURE,
                _advice(study, b.worst.condition, " to be safe for all possible parameters"))
    return (f"Stable: K_bar = Kp^-1 Kd A_bar - I is positive for every joint, smallest margin "
            f"{b.condition.margin:.4g}, and {b.worst.condition.margin:.4g} over all possible "
            "parameters.", GOOD, ())


def _advice(study, condition, purpose):
    joints = study.joints
    return tuple(
        f"Joint {k + 1}: raise Kd from {joints.kd[k]:.4g} above {condition.smallest_kd[k]:.4g} "
        f"N m s/rad, or lower Kp from {joints.kp[k]:.4g} below {condition.largest_kp[k]:.4g} "
        f"N m/rad{purpose}." for k in np.flatnonzero(condition.per_joint <= 0))


def _indeed(found):
    if found["convergence"].here.slowest < 0:
        return "linearised about the true parameters it is indeed unstable at this Gamma"
    return "the PD loop alone is stable, and small errors still die out at this Gamma"


def _lower(linear):
    factor = min(one.least_gain for one in linear.margins["G1"])
    return f"Lower both gains, to less than {factor:.3g} of what they are."


def _condition(study, b):
    joints, worst = study.joints, b.worst.condition
    rows = [(f"joint {k + 1}", _number(b.condition.per_joint[k]), _number(worst.per_joint[k]),
             _number(joints.kd[k]), _number(b.condition.smallest_kd[k]),
             _number(worst.smallest_kd[k]), _number(joints.kp[k]),
             _number(b.condition.largest_kp[k]), _number(worst.largest_kp[k]))
            for k in range(joints.n)]
    marks = tuple(GOOD if value > 0 else BAD for value in worst.per_joint)
    table = Table(("joint", "K_bar", "worst", "Kd", "smallest Kd", "worst", "Kp", "largest Kp",
                   "worst"), tuple(rows), "Gains in N m/rad and N m s/rad", marks)
    box = Table(("parameter", "nominal", "from", "to"), tuple(
        (f"{'abd'[p // joints.n]}{p % joints.n + 1}", _number(joints.theta[p]),
         _number(study.box.lower[p]), _number(study.box.upper[p]))
        for p in range(3 * joints.n)), "Parameters of eq. (9) and the box of the worst case")
    estimates = (_with_estimates(joints, b.ultimate.eta_norm),) if study.is_paper else ()
    return Section("The condition Kp^-1 Kd A_bar - I > 0", (
        "It makes V (A.1) a Lyapunov function of the identification loop, Theorems 1 to 4. It "
        "rises with A and B, so that its worst case over the box is exact and lies at the corner "
        "of the smallest A and B.",), (), (table, box, *estimates), (
        Picture("gain_plane", plots.gain_plane(joints, study.box),
                "Gain plane: green is safe for all parameters of the box."),))


def _with_estimates(joints, eta_norm):
    """What the paper's estimates would have said instead of its real values."""
    rows = []
    for name, theta in (("these parameters", joints.theta),
                        *((f"estimates, CASE {case}", hat)
                          for case, hat in paper.THETA_HAT.items())):
        other = ControlledJoints.from_theta(theta, joints.kp, joints.kd)
        rows.append((name, *map(_number, (
            condition(other).margin, theorem_2(other, 0.0).k_1,
            ultimate_bound(other, eta_norm).mu_0))))
    return Table(("parameters", "smallest K_bar", "k_1", "mu_0"), tuple(rows),
                 "With the estimates of Table 2 in the place of the real values")


def _pd_bound(study, b):
    low, high = b.worst.mu_0
    printed = _printed_mu_0(study)
    rows = (("bound on ||eta|| = ||B PE - D||", _number(b.ultimate.eta_norm),
             f"largest value {b.eta_computed:.6g} at {b.eta_instant:.4g} s",
             _number(paper.ETA_NORM) if study.is_paper else "-"),
            ("smallest eigenvalue of script A", _number(b.ultimate.lambda_min_a), "(17)", "-"),
            ("norm of script B", _number(b.ultimate.norm_b), "(17)", "-"),
            ("mu_0", _number(b.ultimate.mu_0), "(18)", printed),
            ("mu_0, worst over the box", f"{low:.4g} to {high:.4g}",
             "the worst lies between these", "-"),
            ("radius of the level set of V (14)", _number(b.ultimate.invariant.outer),
             f"{b.ultimate.invariant.blow_up:.3g} times mu_0", "-"),
            ("simulated radius after 20 s", _number(b.radius),
             DIVERGED if b.trajectory is None else
             f"mu_0 is {b.ultimate.mu_0 / b.radius:.3g} times as large", "-"))
    return Section("How far the PD loop strays: mu_0", (
        "Outside the ball of radius mu_0 the function V (14) falls. The ball itself is not "
        f"invariant: what traps the loop is the level set V <= {b.ultimate.invariant.level:.4g} "
        "that contains it, and the ball around that set is the bound that holds.",), (),
        (Table(("quantity", "value", "remark", "printed"), rows),),
        () if b.trajectory is None else (
            Picture("phase_plane", plots.phase_plane(b.trajectory, b.ultimate),
                    "The mu_0 circle round the simulated motion (quarter plane of norms)."),))


def _printed_mu_0(study):
    gains = float(study.joints.kp[0]), float(study.joints.kd[0])
    same = np.all(study.joints.kp == gains[0]) and np.all(study.joints.kd == gains[1])
    known = study.is_paper and same and gains in paper.MU_0
    return f"{paper.MU_0[gains]:.4f}" if known else "-"


def _identification(study, b):
    second, fourth, measured = b.second, b.fourth, b.measured
    rows = (
        ("k_1", _number(second.k_1), _number(second.k_1_printed),
         "printed without the -I of K_bar"),
        ("k_2", _number(second.k_2), _number(second.k_2), ""),
        ("mu_1", _number(second.mu_1), _number(second.mu_1_printed),
         f"for eps_bar = {b.eps_bar[0]:.3g} rad/s^2"),
        ("rho", _number(second.rho), _number(second.k_1_printed - second.threshold),
         "(31) only says mu_1 < 1"),
        ("k_3", _number(fourth.k_3), _number(fourth.k_3_printed),
         f"the proof needs the minimum with alpha = {study.alpha:g}"),
        ("k_4", _number(fourth.k_4), _number(fourth.k_4), ""),
        ("mu_2", _number(fourth.mu_2), _number(fourth.mu_2_printed),
         f"(A.12) for eps_bar = {b.eps_bar[1]:.3g}; the theorem's text has another formula"),
        ("varrho", _number(fourth.varrho), _number(fourth.k_3_printed - fourth.threshold),
         "(46) holds" if fourth.holds else "(46) fails with the minimum"))
    run = (("largest modelling error after 5 s", _number(measured["eps"]), "-"),
           ("||E|| after 5 s", _number(measured["e_early"]), _number(measured["mu_1"])),
           ("||E|| in the last 20 s of 400 s", _number(measured["e_late"]),
            _number(measured["mu_1"])),
           ("||(E, e_f)|| in the last 20 s", _number(measured["sigma_late"]),
            _number(measured["mu_2"])))
    said = (DIVERGED if b.errors is None else "In the simulation mu_1 is "
            f"{measured['mu_1'] / max(measured['e_late'], 1e-300):.3g} times the error that "
            "remains.")
    return Section("How far model and robot part: mu_1, mu_2", (
        "mu_1 and mu_2 are radii outside which V (A.1) falls. V also holds the parametric error, "
        "so that E may exceed them while the estimates converge: no bound on E follows from them "
        f"alone. {said}",), (), (
        Table(("constant", "as it follows", "as printed", "difference"), rows),
        Table(("simulated", "value", "mu_1 or mu_2 with it"), run,
              f"Gamma = {study.gamma:g}; update law (27), and (40) with alpha = {study.alpha:g} "
              "for the last row")),
        () if b.errors is None else (
            Picture("identification_error", plots.errors_plot(b),
                    "Identification error against mu_1, and the modelling error that feeds it."),))


def _linear(study, linear):
    tones = PAPER_TONES
    filters = tuple(
        (name, *(f"{100 * error:+.4f} %" for error in found.amplitude_error),
         f"{1e3 * found.delay[0]:.3g}", _number(linear.noise[name]))
        for name, found in linear.filters.items())
    rows = []
    for kind, label in KINDS.items():
        for k, one in enumerate(linear.margins[kind]):
            rows.append((f"joint {k + 1}, {label}", _number(one.gain), _number(one.least_gain),
                         f"{one.phase:.2f}", _number(one.crossover), f"{1e3 * one.delay:.4g}",
                         _number(one.peak_sensitivity)))
    eaten = [bare.phase - lag.phase for bare, lag in zip(linear.margins["exact"],
                                                         linear.margins["G1"])]
    poles = tuple((KINDS[kind], _poles(found.values), _number(float(np.min(found.damping))))
                  for kind, found in linear.poles.items())
    return Section("Frequency responses, poles, margins", (
        "All from linearised diagrams. The lag of G1 eats "
        f"{max(eaten):.3g} degrees of phase margin at most.",), (), (
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


def _poles(values):
    return ", ".join(f"{p.real:.4g}" + (f"{p.imag:+.3g}j" if abs(p.imag) > 1e-6 else "")
                     for p in values)


def _convergence(study, found):
    best_gamma, best = found.best
    wanted = found.gain_for(study.time)
    reach = (f"the smallest gain tried that leaves 1 % after {study.time:g} s is {wanted:.3g}"
             if wanted else f"no gain leaves 1 % after {study.time:g} s")
    plain = found.over_alpha[0.0].slowest
    alphas = tuple((f"{alpha:g}", *(_number(rate) for rate in rates.per_joint),
                    f"{100 * (rates.slowest / plain - 1):+.2g} %")
                   for alpha, rates in found.over_alpha.items())
    slower = "; more is slower again" if best_gamma < found.gammas[-1] else ""
    rows = tuple((f"{gamma:.4g}", _number(rates.slowest), f"{rates.time_constant:.4g}",
                  f"{rates.time_to(0.01):.4g}", _number(float(np.min(averaged))))
                 for gamma, rates, averaged in list(zip(found.gammas, found.rates,
                                                        found.averaged))[::2])
    return Section("How fast the estimates converge", (
        f"Gamma = {study.gamma:g}: the slowest error has {found.here.time_constant:.3g} s and is "
        f"down to 1 % after {found.here.time_to(0.01):.3g} s. The fastest of the gains tried is "
        f"{best_gamma:.3g} with {best.time_constant:.3g} s{slower}; {reach}. "
        "Averaging is right for small gains only.",),
        (), (Table(("Gamma", "slowest rate [1/s]", "time constant [s]", "to 1 % [s]",
                    "averaged rate [1/s]"), rows),
             Table(("alpha", *(f"joint {k + 1} [1/s]" for k in range(study.joints.n)), "change"),
                   alphas, f"Composite law (40) at Gamma = {study.gamma:g}")), (
            Picture("rates", plots.rates_plot(found, study.gamma),
                    "Predicted rate over the adaptation gain: Floquet exponents of the "
                    "linearised periodic loop, and averaging."),))


def _excitation(found):
    if found is None:
        return Section("Excitation", (DIVERGED,))
    rows = tuple((f"{one.window[0]:g}-{one.window[1]:g} s", _number(one.weighted),
                  _number(one.smallest), _number(one.largest), _number(one.condition_number),
                  one.weakest_in_words, _number(other.smallest), _number(other.condition_number))
                 for one, other in zip(found.model, found.filtered))
    designs = tuple(
        (f"joint {k + 1}", ", ".join(f"{f:.3g}" for f in design.frequency),
         ", ".join(f"{a:.3g}" for a in design.amplitude), _number(found.per_second[k]),
         _number(design.smallest), f"{design.smallest / max(found.per_second[k], 1e-300):.2f}")
        for k, design in enumerate(found.designs))
    return Section("Excitation", (
        "The scalar (49) may be positive without any excitation; the smallest eigenvalue of the "
        "matrix in (28) and (42) decides.",), (), (
        Table(("window", "(49)", "smallest of (28)", "largest", "condition", "least excited",
               "smallest of (42)", "condition"), rows),
        Table(("joint", "tones [Hz]", "amplitudes [N m]", "now", "designed", "factor"), designs,
              "A multisine that reaches the same position, velocity and torque at most; smallest "
              "eigenvalue per second")))


def _number(value):
    return f"{value:.5g}"


def _list(values):
    return ", ".join(f"{value:g}" for value in values)
