"""Figures of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.report.wording import (
    Row,
    Units,
    display_scale,
    effect_title,
    units_of,
)
from clie_blocks.errors import ClieError, nearest
from clie_blocks.output import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 900  # per curve, enough for a page and small as SVG
PANELS = 6  # joints that are drawn
QUARTERS = ("position", "velocity", "speed", "torque")
MEASURED, BEFORE, AFTER = "#1c2530", "#c0392b", "#1b6ea8"


def figure(result: Result, name: str) -> Figure:
    """Draw ``motions``, ``probabilities``, ``where`` or ``residuals`` of a result.

    Raises
    ------
    ClieError
        For another name; names the nearest one.

    """
    units, joints = units_of(result.problem.records), result.problem.joints
    drawn = {"motions": lambda: motions(result, units),
             "probabilities": lambda: probabilities(answer(result)["effects"]),
             "where": lambda: where_map(result.where, joints, units),
             "residuals": lambda: residuals(result, units)}
    if name not in drawn:
        raise ClieError(f"no figure is called {name!r}; {nearest(name, drawn)}")
    return drawn[name]()


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def motions(result: Result, units: Units) -> Figure:
    """Measured and predicted motion on the first validation log, and the prediction errors."""
    problem = result.problem
    j = validation_logs(problem)[0]
    log = problem.logs[j]
    before, after = (model.error(j, dithered=False)
                     for model in (result.nominal.hypothesis.seen_by_law,
                                   result.model.hypothesis.seen_by_law))
    keep = slice(None, None, max(1, len(log) // POINTS))
    time = problem.period * np.arange(len(log))[keep]
    shown = min(problem.n, PANELS)
    figure = _figure(9, 3.6 * shown)
    axes = figure.subplots(2 * shown, 1, sharex=True, squeeze=False)[:, 0]
    for k in range(shown):
        above, below = axes[2 * k], axes[2 * k + 1]
        q = log.q[keep, k]
        above.plot(time, q, color=MEASURED, lw=1.6, label="measured")
        above.plot(time, q - before[keep, k], color=BEFORE, lw=0.9, label="nominal model")
        above.plot(time, q - after[keep, k], color=AFTER, lw=0.9, ls="--", label="corrected model")
        factor, unit = display_scale(np.abs(before[keep, k]).max(), units["q"])
        floor = factor * result.residuals.noises[k].floor
        below.axhspan(-floor, floor, color="#d8dee6", lw=0, label="sensor noise")
        below.plot(time, factor * before[keep, k], color=BEFORE, lw=0.8, label="nominal model")
        below.plot(time, factor * after[keep, k], color=AFTER, lw=0.8, label="corrected model")
        above.set_ylabel(plain(f"{problem.joints[k]} [{units['q']}]"))
        below.set_ylabel(f"prediction error [{unit}]")
        for ax in (above, below):
            ax.grid(alpha=0.3)
            ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=8)
    axes[-1].set_xlabel("time [s]")
    return figure


def probabilities(rows: Sequence[Row]) -> Figure:
    """Bars of the probabilities of causes."""
    figure = _figure(8, 0.5 + 0.32 * len(rows))
    ax = figure.subplots()
    positions = np.arange(len(rows))
    ax.barh(positions, [row["probability"] for row in rows], color=AFTER)
    ax.set_yticks(positions, [effect_title(row["effect"]) for row in rows])
    ax.set(xlim=(0, 1), xlabel="probability")
    ax.invert_yaxis()
    ax.grid(axis="x", alpha=0.3)
    return figure


def where_map(where: Mapping[str, Any], joints: Sequence[str], units: Units) -> Figure:
    """Shares by joint, time, frequency, and quarter of the operating range."""
    figure = _figure(9, 5.2 + 0.35 * len(joints))
    (by_joint, by_time), (by_band, by_region) = figure.subplots(2, 2)
    names = [plain(name) for name in joints]
    by_joint.barh(names, [row["share"] for row in where["joint"]], color=BEFORE)
    by_joint.set(xlim=(0, 1), title="joint", xlabel="share")
    by_joint.invert_yaxis()
    for log in where["time"]:
        start = log["seconds_per_part"] * np.arange(len(log["share"]) + 1)
        by_time.stairs(log["share"], start, label=f"log {log['log']}")
    by_time.set(title="time", xlabel="time [s]", ylabel="share of the log")
    by_time.legend(frameon=False, fontsize=8)
    bands = [f"{low:g}-{high:g}" for low, high in (row["band_hz"] for row in where["frequency"])]
    by_band.bar(bands, [row["share"] for row in where["frequency"]], color=BEFORE)
    by_band.set(title="frequency", xlabel="band [Hz]", ylabel="share", ylim=(0, 1))
    _regions(by_region, where["region"], names)
    return figure


def _regions(ax: Axes, regions: Sequence[Row], names: Sequence[str]) -> None:
    cells = np.array([[share for kind in QUARTERS for share in row[kind]["share"]]
                      for row in regions])
    image = ax.imshow(cells, cmap="OrRd", vmin=0.0, vmax=max(0.5, cells.max()), aspect="auto")
    ax.set_yticks(range(len(names)), names)
    ax.set_xticks(np.arange(len(QUARTERS)) * 4 + 1.5, QUARTERS)
    for edge in range(4, cells.shape[1], 4):
        ax.axvline(edge - 0.5, color="white", lw=2)
    ax.set_title("operating range, lowest to highest quarter")
    ax.figure.colorbar(image, ax=ax, label="share")


def residuals(result: Result, units: Units) -> Figure:
    """Residual of the best model at the joint with the largest error, against its regressors."""
    problem, model = result.problem, result.model.hypothesis.seen_by_law
    errors = [model.error(j) for j in range(len(problem.logs))]
    k = int(np.argmax(np.mean(np.concatenate(errors) ** 2, axis=0)))
    e, q, u = (np.concatenate([rows[:, k] for rows in columns]) for columns in (
        errors, [log.q for log in problem.logs], [log.u for log in problem.logs]))
    dq = np.concatenate([np.gradient(log.q[:, k], problem.period) for log in problem.logs])
    time = np.concatenate([problem.period * np.arange(len(log)) for log in problem.logs])
    figure = _figure(9, 5)
    panels = figure.subplots(2, 3).ravel()
    thin = slice(None, None, max(1, len(e) // 1500))
    for ax, x, label in zip(panels, (dq, q, u, time), (
            f"velocity [{units['q']}/s]", f"position [{units['q']}]", f"command [{units['u']}]",
            "time [s]")):
        ax.plot(x[thin], e[thin], ".", ms=1.5, color=BEFORE, rasterized=True)
        ax.set(xlabel=label, ylabel=f"residual [{units['q']}]")
    spectrum = np.abs(np.fft.rfft(errors[0][:, k])) / len(errors[0])
    grid = np.fft.rfftfreq(len(errors[0]), problem.period)
    low = (grid > 0) & (grid < 50)
    panels[4].loglog(grid[low], spectrum[low], lw=0.7, color=BEFORE)
    panels[4].set(xlabel="frequency [Hz]", ylabel=f"residual [{units['q']}]")
    panels[5].axis("off")
    return figure
