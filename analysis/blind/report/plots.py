"""Plots of the scoreboard."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure


def confusion_matrix(confusion: dict[str, dict[str, int]]) -> Figure:
    """Draw how often each truth led to which decision, from counts by truth and decision."""
    truths = sorted(confusion)
    decisions = truths + sorted({decision for row in confusion.values() for decision in row}
                                - set(truths))
    counts = np.array([[confusion[true].get(decision, 0) for decision in decisions]
                       for true in truths], float).reshape(len(truths), len(decisions))
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    size = 2.5 + 0.3 * len(decisions), 2.0 + 0.3 * len(truths)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in np.argwhere(counts > 0):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=7,
                  color="white" if share[i, j] > 0.5 else "black")
    axes.set_xticks(range(len(decisions)), decisions, rotation=90, fontsize=7)
    axes.set_yticks(range(len(truths)), truths, fontsize=7)
    axes.set_xlabel("decision")
    axes.set_ylabel("truth")
    return figure


def reliability(table: Sequence[dict[str, Any]]) -> Figure:
    """Draw stated against observed shares of right decisions, one row of `calibration` per bin."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", lw=1)
    for row in table:
        low, high = row["observed"]["interval"]
        axes.plot([row["stated"]] * 2, [low, high], color="tab:blue", lw=1)
        axes.plot(row["stated"], row["observed"]["rate"], "o", color="tab:blue")
        axes.annotate(str(row["observed"]["of"]), (row["stated"], row["observed"]["rate"]),
                      textcoords="offset points", xytext=(5, -9), fontsize=7)
    axes.set_xlabel("stated probability of the decision")
    axes.set_ylabel("share of right decisions")
    axes.set_xlim(0, 1.03)
    axes.set_ylim(0, 1.03)
    return figure


def shares(table: dict[str, dict[str, Any]]) -> Figure:
    """Draw rates of `intervals.rate` with their intervals, one line per name."""
    figure = Figure(figsize=(7.0, 1.1 + 0.22 * len(table)), layout="constrained")
    axes = figure.add_subplot()
    for row, share in enumerate(table.values()):
        if not share["of"]:
            continue
        axes.plot(share["interval"], [row, row], color="tab:blue", lw=1)
        axes.plot(share["rate"], row, "o", color="tab:blue", ms=4)
    axes.set_yticks(range(len(table)), list(table), fontsize=8)
    axes.set_ylim(len(table) - 0.5, -0.5)
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("share named right")
    axes.grid(axis="x", color="0.9")
    return figure


def reductions(points: Sequence[tuple[float, float, bool]]) -> Figure:
    """Draw achieved against achievable reduction of the gap, one point per trial.

    The third entry of a point says whether the diagnosis was right.
    """
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", lw=1)
    for right, mark, name in ((True, "o", "right"), (False, "x", "not right")):
        pairs = [point[:2] for point in points if point[2] == right]
        if pairs:
            axes.plot(*zip(*pairs), mark, ms=4, alpha=0.7, label=f"diagnosis {name}")
    axes.set_xlabel("achievable reduction of the gap (true model)")
    axes.set_ylabel("achieved reduction of the gap")
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.25, 1.02)
    if points:
        axes.legend(loc="upper left", fontsize=8)
    return figure
