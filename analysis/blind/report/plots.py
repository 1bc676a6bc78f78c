"""Pictures of the scoreboard."""

import numpy as np
from matplotlib.figure import Figure


def confusion_matrix(confusion):
    """Draw how often each truth was decided to be what.

    Parameters
    ----------
    confusion : dict
        Truth -> decision -> count.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    """
    truths = sorted(confusion)
    decisions = truths + sorted({said for row in confusion.values() for said in row}
                                - set(truths))
    counts = np.array([[confusion[true].get(said, 0) for said in decisions] for true in truths],
                      float).reshape(len(truths), len(decisions))
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


def reliability(table):
    """Draw stated against observed shares of right decisions.

    Parameters
    ----------
    table : list of dict
        ``stated`` and ``observed`` per bin, from `calibration`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    """
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
    axes.set_ylabel("share that was right")
    axes.set_xlim(0, 1.03)
    axes.set_ylim(0, 1.03)
    return figure


def shares(table):
    """Draw rates with their intervals, one line per name.

    Parameters
    ----------
    table : dict
        Name -> rate, from `rates.rate`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    """
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


def reductions(points):
    """Draw achieved against achievable reduction of the gap, one point per trial.

    Parameters
    ----------
    points : list of (float, float, bool)
        Achievable, achieved, and whether the diagnosis was right.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    """
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", lw=1)
    for right, mark, name in ((True, "o", "right"), (False, "x", "not right")):
        found = [point[:2] for point in points if point[2] == right]
        if found:
            axes.plot(*zip(*found), mark, ms=4, alpha=0.7, label=f"diagnosis {name}")
    axes.set_xlabel("reduction of the gap that the true model brings")
    axes.set_ylabel("reduction that was achieved")
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.25, 1.02)
    if points:
        axes.legend(loc="upper left", fontsize=8)
    return figure
