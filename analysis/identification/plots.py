"""How CLIE converged on a log: input error and estimates over its last pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clie_blocks.analysis.identification.clie import LastPass
from clie_blocks.output import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def convergence_figure(last: LastPass, joints: tuple[str, ...], unit: str) -> Figure:
    """Input error [unit of u] and estimates over their means, sample by sample."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for name, error in zip(joints, last.e_u, strict=True):
        above.plot(error, lw=0.8, label=plain(f"input error, {name}"))
    ratios = last.theta_hat / last.theta[:, None]
    labels = [plain(f"{symbol}_hat {joint}") for symbol in "abd" for joint in joints]
    for ratio, label in zip(ratios, labels, strict=True):
        below.plot(ratio, lw=0.8, label=label)
    above.set_ylabel(f"input error [{unit}]")
    below.set(xlabel="sample", ylabel="estimate over its mean [1]", ylim=(0, 2))
    for ax in (above, below):
        ax.grid(alpha=0.3)
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=6, frameon=False, fontsize=8)
    figure.suptitle(f"CLIE (27), pass {last.passes}")
    return figure
