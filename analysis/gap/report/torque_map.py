"""The torque map: residual torque that every lap repeats, as a table and drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.assessment.torque_map import TorqueMap
from clie_blocks.analysis.gap.report.plots import AFTER, BEFORE, PANELS
from clie_blocks.analysis.gap.report.wording import (
    Units,
    effect_title,
    effort,
    join_words,
    number,
    with_prefix,
)
from clie_blocks.analysis.report.document import Picture, Section
from clie_blocks.output import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BAND = 0.25  # opacity


def torque_map_section(result: Result, units: Units) -> Section | None:
    """The torque map over position and velocity; None where it does not pay."""
    table = result.torque_map
    if table is None:
        return None
    interval = "" if table.interval is None else (
        f" ({number(table.interval[0])} .. {number(table.interval[1])})")
    causes = join_words(map(effect_title, table.causes)) or "the refitted nominal model"
    text = (f"A torque map over position and velocity, one for each direction of motion, added to "
            f"{causes}, removes {number(table.percent)} %{interval} of the remaining reducible "
            f"gap on unseen data, down to {with_prefix(table.gap, units['q'])}: the residual "
            "torque repeats along the travel. The map names no cause and changes no verdict; a "
            "simulator can add it to that model. Its values are in the JSON answer under "
            "repeatable.")
    picture = Picture("torque-map", curves(table, result.problem.joints, units),
                      "Torque against the motion, added to that of the model. Left: over "
                      "position, with mean zero. Right: over speed, with the level. Bands: 95 % "
                      "intervals, from maps that leave out parts of the logs.")
    return Section("Repeatable residual torque", (text,), pictures=(picture,))


def curves(torque_map: TorqueMap, joints: Sequence[str], units: Units) -> Figure:
    """Torque over position and over speed at each joint, in both directions."""
    from matplotlib.figure import Figure

    tables = torque_map.joints[:PANELS]
    figure = Figure(figsize=(9, 3.2 * len(tables)), layout="constrained")
    axes = figure.subplots(len(tables), 2, squeeze=False)
    for table, (over_place, over_speed) in zip(tables, axes):
        name = plain(joints[table.joint])
        _draw(over_place, table.positions, table.over_position, table.position_spread)
        _draw(over_speed, table.speeds, table.over_speed, table.speed_spread)
        over_place.set(xlabel=f"{name}: position [{units['q']}]",
                       ylabel=f"residual {effort(units)} [{units['u']}]")
        over_speed.set(xlabel=f"{name}: speed [{units['q']}/s]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def _draw(ax: Axes, knots: np.ndarray, torques: np.ndarray, spreads: np.ndarray) -> None:
    for torque, spread, color, label in zip(torques, spreads, (AFTER, BEFORE),
                                            ("forward", "backward")):
        ax.plot(knots, torque, color=color, lw=1.4, label=label)
        ax.fill_between(knots, torque - spread, torque + spread, color=color, alpha=BAND, lw=0)
    ax.axhline(0.0, color="#8a94a0", lw=0.7)
    ax.grid(alpha=0.3)
