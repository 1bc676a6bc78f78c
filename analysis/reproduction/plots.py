"""Figs. 3, 4 and 6 of the paper, from our runs."""

import numpy as np
from matplotlib.figure import Figure

from clie_blocks import paper
from clie_blocks.analysis.reproduction.runs import Levels


def figure_3(with_excitation: Levels, without: Levels) -> Figure:
    """Weighted integral (49) over its windows, and the smallest eigenvalue of (28)."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    for (levels, curves), colour, label in ((with_excitation, "C0", "excitation (48)"),
                                            (without, "C3", "no excitation")):
        time, integral = (np.concatenate(part) for part in zip(*curves))
        left.plot(time, integral, color=colour, lw=1.2, label=label)
        middle = [np.mean(one.window) for one in levels]
        right.semilogy(middle, [max(one.smallest, 1e-17) for one in levels], "o-", color=colour,
                       label=label)
    left.set(xlabel="time [s]", ylabel="integral (49)", title="as in Fig. 3")
    right.set(xlabel="middle of the window [s]", ylabel="smallest eigenvalue of (28)",
              title="what Fig. 3 does not show")
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.legend()
    return figure


def figure_4(runs: dict[int, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Estimates of the three cases over time, with real and printed values, Fig. 4.

    `runs` holds time [s] and theta_hat, shape (6, samples), by case.
    """
    figure = Figure(figsize=(9, 7), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    for k, ax in enumerate(axes.flat):
        for (case, (time, theta_hat)), style in zip(runs.items(), ("-", "--", ":")):
            ax.plot(time, theta_hat[k], style, lw=1.2, label=f"CASE {case}")
        ax.axhline(paper.THETA[k], color="k", lw=0.8, label="real value, Table 2")
        ax.set_ylabel(f"{paper.THETA_NAMES[k]} [{paper.THETA_UNITS[k]}]")
        settled = np.concatenate([rows[k, len(rows[k]) // 5:] for _, rows in runs.values()])
        low, high = np.min(settled), np.max(settled)
        low, high = min(low, paper.THETA[k]), max(high, paper.THETA[k])
        ax.set_ylim(low - 0.3 * (high - low), high + 0.2 * (high - low))
        ax.grid(alpha=0.3)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def figure_6(time: np.ndarray, wanted: np.ndarray, reached: np.ndarray) -> Figure:
    """Tracking with (50), Fig. 6, and its error; positions of shape (2, samples) [rad]."""
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", width_ratios=(3, 2))
    for k, (whole, start) in enumerate(axes):
        whole.plot(time, wanted[k], "k--", lw=1.0, label="reference")
        whole.plot(time, reached[k], color="C0", lw=1.0, label="robot")
        whole.set_ylabel(f"joint {k + 1} [rad]")
        start.plot(time, 1e3 * (wanted[k] - reached[k]), color="C3", lw=1.0)
        start.set(ylabel="error [mrad]", xlim=(0, 10))
        for ax in (whole, start):
            ax.grid(alpha=0.3)
    axes[0, 0].legend(loc="upper right")
    axes[0, 0].set_title("tracking, Fig. 6")
    axes[0, 1].set_title("error in the first 10 s")
    for ax in axes[1]:
        ax.set_xlabel("time [s]")
    return figure
