"""One page with the signals of a checked log, its findings marked where they are."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.model import Record
from clie_blocks.output import plain, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"error": "tab:red", "warning": "tab:orange", "repair": "tab:blue"}
MOST_POINTS = 4000
SHOWN = ("q", "u", "dq", "tau")


def save_page(record: Record, findings: Sequence[Finding], verdict: str,
              folder: str | os.PathLike[str], stem: str) -> list[str]:
    """Draw the signals of a record with the samples of its findings, and return the files."""
    from matplotlib.figure import Figure

    names = [name for name in SHOWN if name in record.signals]
    figure = Figure(figsize=(4.5 * record.n + 1, 2.2 * len(names) + 1), layout="constrained")
    axes = figure.subplots(len(names), record.n, squeeze=False, sharex=True)
    for row, name in zip(axes, names, strict=True):
        for k, axis in enumerate(row):
            _signal(axis, record, name, k)
            _marks(axis, record, findings, k)
    for k, axis in enumerate(axes[-1]):
        axis.set_xlabel("time [s]")
        axes[0][k].set_title(plain(record.joints[k]))
    figure.suptitle(plain(f"{record.source}: {verdict}"), fontsize=9)
    return save_figure(figure, folder, stem, formats=("png",))


def _signal(axis: "Axes", record: Record, name: str, k: int) -> None:
    """Envelope of a long signal, so that no peak is lost; the reference behind the position."""
    if name == "q" and record.qd is not None:
        axis.plot(*_thinned(record.time, record.qd[:, k]), color="0.7", lw=1, label="reference")
        axis.legend(fontsize=7)
    axis.plot(*_thinned(record.time, np.where(record.valid, getattr(record, name)[:, k], np.nan)),
              lw=0.8)
    axis.set_ylabel(f"{name} [{record.units[name][k]}]")


def _thinned(time: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    block = 2 * len(x) // MOST_POINTS
    if block < 2:
        return time, x
    cut = len(x) // block * block
    parts = x[:cut].reshape(-1, block)
    holes = ~np.isfinite(parts).any(axis=1)
    low = np.where(holes, np.nan, np.where(np.isfinite(parts), parts, np.inf).min(axis=1))
    high = np.where(holes, np.nan, np.where(np.isfinite(parts), parts, -np.inf).max(axis=1))
    return np.repeat(time[:cut:block], 2), np.stack((low, high), axis=1).ravel()


def _marks(axis: "Axes", record: Record, findings: Sequence[Finding], k: int) -> None:
    for finding in findings:
        if finding.joint in (None, record.joints[k]):
            for start, stop in finding.samples:
                axis.axvspan(record.time[start], record.time[min(stop, len(record)) - 1],
                             color=COLOURS[finding.severity], alpha=0.3)
