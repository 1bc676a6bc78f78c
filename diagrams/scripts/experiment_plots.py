"""Plots of an identification run: Fig. 2 as built, estimates (Fig. 4), input error, motion."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from clie_blocks import paper
from clie_blocks.diagrams.picture import draw
from clie_blocks.output import save_figure
from clie_blocks.signals import Diagram, signal

if TYPE_CHECKING:
    import control as ct
    from matplotlib.axes import Axes


def save_plots(diagram: Diagram, case: int, response: ct.TimeResponseData,
               folder: str | PathLike) -> list[str]:
    """Save all plots of a run as PNG and SVG, and return their paths."""
    time = response.time
    figures = {
        "diagram": draw(diagram),
        "estimates": estimates(time, signal(response, "theta_hat"),
                               paper.THETA_HAT[case]),
        "input_error": input_error(time, signal(response, "e_u")),
        "motion": motion(time, signal(response, "q"), signal(response, "q_model"))}
    return [path for stem, figure in figures.items()
            for path in save_figure(figure, folder, f"case_{case}_{stem}")]


def estimates(time: np.ndarray, theta_hat: np.ndarray, printed: np.ndarray) -> Figure:
    """Estimates over time with the real and the printed values, Fig. 4.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Time [s].
    theta_hat : ndarray, shape (6, samples)
        Estimates ``[a1, a2, b1, b2, d1, d2]``.
    printed : ndarray, shape (6,)
        The paper's estimates.

    """
    figure = Figure(figsize=(9, 7), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    for k, ax in enumerate(axes.flat):
        ax.plot(time, theta_hat[k], lw=0.9, color="C0", label="estimate")
        ax.axhline(paper.THETA[k], color="k", lw=0.8, label="real value, Table 2")
        ax.axhline(printed[k], color="C3", lw=0.9, ls="--", label="the paper's estimate")
        ax.set_ylabel(f"{paper.THETA_NAMES[k]} [{paper.THETA_UNITS[k]}]")
        _focus(ax, theta_hat[k], paper.THETA[k])
        ax.grid(alpha=0.3)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def input_error(time: np.ndarray, e_u: np.ndarray) -> Figure:
    """Input error of both joints, eq. (26), over the run and in its last ten seconds.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Time [s].
    e_u : ndarray, shape (2, samples)
        Input error [N m].

    """
    figure = Figure(figsize=(9, 4), layout="constrained")
    whole, end = figure.subplots(1, 2, width_ratios=(2, 1))
    for ax, rows in ((whole, time >= 0), (end, time >= time[-1] - 10)):
        for k, row in enumerate(e_u, start=1):
            ax.plot(time[rows], row[rows], lw=0.8, label=f"joint {k}")
        ax.set(xlabel="time [s]", ylabel="input error v - u [N m]")
        ax.grid(alpha=0.3)
    whole.set_title("whole run")
    end.set_title("last 10 s")
    whole.legend()
    return figure


def motion(time: np.ndarray, q: np.ndarray, q_model: np.ndarray) -> Figure:
    """Joint positions of robot and model at the start and at the end of the run.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Time [s].
    q, q_model : ndarray, shape (2, samples)
        Positions [rad].

    """
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots(2, 2)
    for k in range(2):
        for ax, rows, title in ((axes[k, 0], time <= 10, "first 10 s"),
                                (axes[k, 1], time >= time[-1] - 10, "last 10 s")):
            ax.plot(time[rows], q[k, rows], lw=1.6, color="C0", label="robot")
            ax.plot(time[rows], q_model[k, rows], lw=1.0, color="C1", ls="--", label="model")
            ax.set_ylabel(f"joint {k + 1} [rad]")
            ax.grid(alpha=0.3)
            if k == 0:
                ax.set_title(title)
            else:
                ax.set_xlabel("time [s]")
    axes[0, 0].legend()
    return figure


def _focus(ax: Axes, values: np.ndarray, target: float) -> None:
    """Show the settled part: the first transient would flatten everything else."""
    settled = values[len(values) // 20:]
    low, high = min(settled.min(), target), max(settled.max(), target)
    margin = 0.08 * max(high - low, 1e-12) + 1e-3 * np.abs(target)
    ax.set_ylim(low - margin, high + margin)
