"""The pictures of a stability report."""

import numpy as np
from matplotlib.figure import Figure

from clie_blocks.analysis.stability_report.convergence_sweep import Convergence
from clie_blocks.analysis.stability_report.loop_bounds import Bounds
from clie_blocks.analysis.stability_report.simulated_bounds import Trajectory
from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.stability_report.worst_case import ParameterBox
from clie_blocks.analysis.theory.bounds import ControlledJoints, UltimateBound
from clie_blocks.analysis.theory.frequency import (
    PAPER_TONES,
    Margins,
    filter_response,
    gain_sweep,
)
from clie_blocks.filters import lowpass, velocity_filter

NORM = "[rad, rad/s]"  # of a radius: the paper adds the squares of both
SWEEP = np.geomspace(0.1, 300, 50)


def gain_plane(joints: ControlledJoints, box: ParameterBox) -> Figure:
    """Plane of Kp and Kd with the region where the condition holds, and the chosen gains.

    The worst edge is that of the slowest corner of the box.
    """
    figure = Figure(figsize=(4.2 * min(joints.n, 3), 3.8), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, min(joints.n, 3), squeeze=False)[0])
    a_low, b_low, _ = np.reshape(box.lower, (3, -1))
    for k, ax in enumerate(axes):
        kd = np.linspace(0, 2.2 * joints.kd[k], 200)
        edge = kd * (joints.a[k] + joints.b[k] * kd)
        worst = kd * (a_low[k] + b_low[k] * kd)
        ax.fill_betweenx(kd, 0, worst, color="C2", alpha=0.2, label="safe for all parameters")
        ax.plot(edge, kd, "k", lw=1.2, label="edge, nominal")
        ax.plot(worst, kd, "C2--", lw=1.0, label="edge, worst case")
        ax.plot(joints.kp[k], joints.kd[k], "o", color="C3", ms=8, label="chosen")
        ax.set(xlim=(0, 2.5 * max(joints.kp[k], edge[100])), ylim=(0, kd[-1]),
               title=f"joint {k + 1}", xlabel="Kp [N m/rad]", ylabel="Kd [N m s/rad]")
        ax.grid(alpha=0.3)
    axes[0].legend(fontsize=8, loc="upper left")
    return figure


def filter_bode() -> Figure:
    """Bode plot of G1 and G2 as errors against the ideal, with the excitation's tones marked."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    omega = np.geomspace(0.3, 1e4, 400)
    tones = 2 * np.pi * np.array(PAPER_TONES)
    for column, (block, name, rate) in enumerate(((velocity_filter(1), "G1, velocity", True),
                                                  (lowpass(1), "G2, low-pass", False))):
        curve = filter_response(block, omega, rate)
        at_tones = filter_response(block, tones, rate)
        magnitude, phase, delay = axes[:, column]
        magnitude.loglog(omega, np.abs(curve.response))
        magnitude.loglog(tones, np.abs(at_tones.response), "o", color="C3",
                         label="tones of the excitation")
        for w, error, offset in zip(tones, at_tones.amplitude_error, ((-42, 6), (6, -11))):
            magnitude.annotate(f"{100 * error:+.3f} %", (w, np.abs(block(1j * w))), fontsize=8,
                               xytext=offset, textcoords="offset points")
        phase.semilogx(omega, np.degrees(np.unwrap(np.angle(curve.response))))
        delay.semilogx(omega, 1e3 * curve.delay)
        delay.semilogx(tones, 1e3 * at_tones.delay, "o", color="C3")
        magnitude.set_title(name)
        magnitude.set_ymargin(0.15)
        magnitude.legend(fontsize=8)
        delay.set_xlabel("frequency [rad/s]")
    for ax, label in zip(axes[:, 0], ("magnitude", "phase [deg]", "lag behind ideal [ms]")):
        ax.set_ylabel(label)
    axes[0, 0].set_ylabel("magnitude [1/s]")
    axes[0, 1].set_ylabel("magnitude [-]")
    for ax in axes.flat:
        ax.minorticks_off()  # most of the time that a picture takes
        ax.grid(alpha=0.3)
    return figure


def loop_plots(margins: dict[str, list[Margins]], joint: int = 0) -> Figure:
    """Loop transfer, and sensitivities at the plant input, with exact velocity and through G1.

    The keys of `margins` are ``'exact'`` and ``'G1'``; `joint` counts from 0.
    """
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    (magnitude, sensitivity), (phase, complementary) = figure.subplots(2, 2, sharex=True)
    for (kind, per_joint), colour in zip(margins.items(), ("C0", "C3")):
        one = per_joint[joint]
        omega = np.geomspace(one.crossover / 100, one.crossover * 1000, 400)
        loop = np.squeeze(one.loop(1j * omega))
        s, t = one.sensitivities(omega)
        label = "exact velocity" if kind == "exact" else "velocity through G1"
        magnitude.loglog(omega, np.abs(loop), color=colour, label=label)
        phase.semilogx(omega, np.degrees(np.unwrap(np.angle(loop))), color=colour)
        phase.plot(one.crossover, one.phase - 180, "o", color=colour)
        sensitivity.loglog(omega, np.abs(s), color=colour)
        complementary.loglog(omega, np.abs(t), color=colour)
    magnitude.axhline(1, color="k", lw=0.6)
    phase.axhline(-180, color="k", lw=0.6)
    for ax, label in zip((magnitude, phase, sensitivity, complementary),
                         ("|L| [-]", "phase of L [deg]", "|S| [-]", "|T| [-]")):
        ax.set_ylabel(label)
        ax.minorticks_off()
        ax.grid(alpha=0.3)
    for ax in (phase, complementary):
        ax.set_xlabel("frequency [rad/s]")
    magnitude.legend(fontsize=8)
    magnitude.set_title(f"loop at the plant input, joint {joint + 1}")
    sensitivity.set_title("sensitivity and complementary sensitivity")
    return figure


def pole_map(study: Study) -> Figure:
    """Poles of the PD loop while both gains are scaled, with and without G1."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    joints = study.joints
    for ax, (filtered, title) in zip(figure.subplots(1, 2), ((False, "exact velocity"),
                                                             (True, "velocity through G1"))):
        poles, here = (gain_sweep(study.plant, joints.kp, joints.kd, factors, filtered=filtered,
                                  q=study.q_d) for factors in (SWEEP, [1.0]))
        points = ax.scatter(poles.real.ravel(), poles.imag.ravel(), s=5,
                            c=np.repeat(np.log10(SWEEP), poles.shape[1]), cmap="viridis")
        ax.plot(here.real.ravel(), here.imag.ravel(), "x", color="C3", ms=8, mew=2,
                label="chosen gains")
        ax.axvline(0, color="k", lw=0.8)
        height = 1.5 * max(10.0, np.max(np.abs(poles.imag)))
        ax.set_xscale("symlog", linthresh=1)
        ax.set_yscale("symlog", linthresh=1)
        ax.set(title=title, xlabel="real part [rad/s]", ylim=(-height, height))
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8, loc="upper left")
    figure.axes[0].set_ylabel("imaginary part [rad/s]")
    figure.colorbar(points, ax=figure.axes[:2], label="log10 of the factor on both gains")
    return figure


def phase_plane(trajectory: Trajectory, ultimate: UltimateBound) -> Figure:
    """Motion of the PD loop against the mu_0 circle and the circle around its level set."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    time, q_err, dq = trajectory
    x, y = (np.linalg.norm(rows, axis=0) for rows in (q_err, dq))
    quarter = np.linspace(0, np.pi / 2, 100)
    for ax, title in zip(figure.subplots(1, 2), ("from rest", "settled, after 20 s")):
        shown = time >= (20.0 if title.startswith("settled") else 0.0)
        ax.plot(x[shown], y[shown], color="C0", lw=0.9, label="simulated")
        for radius, style, label in ((ultimate.mu_0, "C3-", "mu_0"),
                                     (ultimate.invariant.outer, "C1--", "around the level set")):
            ax.plot(radius * np.cos(quarter), radius * np.sin(quarter), style, lw=1.2,
                    label=f"{label}: {radius:.4g} {NORM}")
        ax.set(title=title, xlabel="norm of the position error [rad]", xlim=(0, None),
               ylim=(0, None))
        ax.grid(alpha=0.3)
    left, right = figure.axes
    left.set_ylabel("norm of the velocity [rad/s]")
    limit = 1.15 * ultimate.mu_0
    right.set(xlim=(0, limit), ylim=(0, limit))
    left.legend(fontsize=8)
    return figure


def rates_plot(convergence: Convergence, gamma: float) -> Figure:
    """Slowest Floquet rate of each joint over Gamma, and what averaging predicts."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    ax = figure.subplots()
    rates = np.array([one.per_joint for one in convergence.rates])
    rates = np.where(rates > 0, rates, np.nan)
    if np.all(np.isnan(rates)):
        ax.text(0.5, 0.5, "the estimates converge at no gain", ha="center")
        return figure
    for k, row in enumerate(rates.T):
        ax.loglog(convergence.gammas, row, f"C{k}", label=f"joint {k + 1}, Floquet")
        ax.loglog(convergence.gammas, convergence.averaged[:, k], f"C{k}:", lw=1,
                  label=f"joint {k + 1}, averaged")
    if convergence.here.slowest > 0:
        ax.plot(gamma, convergence.here.slowest, "o", color="C3", label="chosen")
    ax.set(xlabel="adaptation gain Gamma", ylabel="rate of the slowest mode [1/s]",
           ylim=(np.nanmin(rates) / 2, 3 * np.nanmax(rates)))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return figure


def errors_plot(bounds: Bounds) -> Figure:
    """Identification error over time against mu_1, and the modelling error behind it."""
    if bounds.errors is None:
        raise ValueError("no errors to draw: the simulated identification diverged")
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    time = bounds.errors["time"]
    norm = np.linalg.norm(np.vstack((bounds.errors["e"], bounds.errors["de"])), axis=0)
    eps = np.linalg.norm(bounds.errors["eps"], axis=0)
    left.semilogy(time[1:], norm[1:], lw=0.6, label="||E||, simulated")
    if np.isfinite(bounds.measured["mu_1"]):
        left.axhline(bounds.measured["mu_1"], color="C3", label="mu_1 with the simulated error")
    right.semilogy(time[1:], np.maximum(eps[1:], 1e-16), lw=0.6)
    left.set(xlabel="time [s]", ylabel=f"||(e, de)|| {NORM}")
    right.set(xlabel="time [s]", ylabel="modelling error of (29) [rad/s^2]")
    left.legend(fontsize=8)
    for ax in (left, right):
        ax.grid(alpha=0.3)
    return figure
