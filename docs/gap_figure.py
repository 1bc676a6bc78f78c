"""Draw a gap, its cause and its closing, from an example log: ``python docs/gap_figure.py``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.gap import Diagnosis, diagnose, read
from clie_blocks.output import run_main, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

JOINT, HELD_OUT = 1, 2  # the elbow, in the log that no model was fitted to
INK, BEFORE, AFTER, NOISE = "#1c2530", "#c0392b", "#1b6ea8", "#d8dee6"


def figure(found: Diagnosis) -> Figure:
    """Prediction error of the model, friction law that was found, and error with it."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(11, 3.1), layout="constrained")
    gap, cause, closed = drawn.subplots(1, 3)
    before, after = (1e3 * fit.hypothesis.error(HELD_OUT)[:, JOINT]
                     for fit in (found.nominal, found.model))
    band = 1e3 * found.residuals.noises[JOINT].floor
    smaller = np.sqrt(np.mean(before**2) / np.mean(after**2))
    for axes, error, colour, title in (
            (gap, before, BEFORE, "The gap: robot less model"),
            (closed, after, AFTER, f"Its closing: error {smaller:.0f} times smaller")):
        _errors(axes, found.problem.period, error, band, colour, title)
        axes.set_ylim(1.4 * np.array([-1, 1]) * np.abs(error).max())
    _law(cause, found)
    return drawn


def _errors(axes: Axes, period: float, error: np.ndarray, band: float, colour: str,
            title: str) -> None:
    axes.axhspan(-band, band, color=NOISE, lw=0, label="sensor noise")
    axes.plot(period * np.arange(len(error))[::4], error[::4], color=colour, lw=0.7,
              label=f"RMS {np.sqrt(np.mean(error**2)):.2g} mrad")
    axes.set(title=title, xlabel="time on unseen data [s]", ylabel="error at the elbow [mrad]")
    axes.legend(frameon=False, loc="upper right", fontsize=8, ncols=2)


def _law(axes: Axes, found: Diagnosis) -> None:
    """Dry friction of the elbow over its velocity, at the motor."""
    (setting,) = found.effects()
    level = 1e3 * setting.values["level"][JOINT]
    row = found.to_dict()["effects"][0]
    axes.plot([-1, 0, 0, 1], [-level, -level, level, level], color=INK, lw=2)
    axes.axhline(0, color=INK, lw=0.5)
    axes.text(0.06, 0.5 * level, f"elbow: {level:.2f} mN m\nat the motor", color=INK, va="center")
    axes.set(title=f"Its cause: {row['effect']} friction", xlabel="velocity [rad/s]",
             ylabel="missing torque [mN m]", xlim=(-1, 1),
             ylim=(-1.5 * level, 1.5 * level))


def main(argv: Sequence[str] | None = None) -> None:
    """Diagnose the example and write one SVG."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("-o", "--output", default=Path(__file__).parent / "figures",
                         metavar="DIR", help="folder for the picture")
    folder = options.parse_args(argv).output
    drawn = figure(diagnose(read(FOLDER / "friction-arm")))
    print(*save_figure(drawn, folder, "gap", formats=("svg",)))


if __name__ == "__main__":
    run_main(main)
