"""The page of a fleet: what its units share, what differs, and which one is odd."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.assessment.by_log import JOINT_MODEL
from clie_blocks.analysis.gap.fleet.comparison import Fleet, FleetParameter
from clie_blocks.analysis.gap.report.wording import join_words, number
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Document,
    Link,
    Picture,
    Section,
    Table,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS, MOST_PANELS = 3, 12
POINT, ODD_POINT, BAND = "#1b6ea8", "#c0392b", "#d7e3ee"
HOW = ("Each parameter is fitted to each log alone. What the intervals of these fits do not "
       "explain is split into what differs from unit to unit (wear, tolerance) and from log to "
       "log of one unit (heat, day), by restricted maximum likelihood. A unit is odd where it is "
       "farther from all others than these explain, with 5 % for a false alarm in the whole "
       "fleet; the common values leave it out.")


def page(fleet: Fleet) -> Document:
    """Arrange the comparison of the units of a fleet."""
    odd = fleet.odd()
    verdict = (" ".join(f"{robot} is odd: {'; '.join(reasons)}." for robot, reasons in odd.items())
               or f"None of the {len(fleet.robots)} units is odd.")
    sections = [Section("Units", tables=(_units(fleet),)),
                Section("Parameters", (HOW,), tables=(_parameters(fleet),))]
    drawn = _drawn(fleet)
    if drawn:
        sections.append(Section("From unit to unit", pictures=(Picture(
            "fleet", _figure(fleet, drawn), "Value from each log, unit by unit, with its 95 % "
            "interval; the band is that of the common value, odd units are red."),)))
    return Document(f"{len(fleet.robots)} units of one robot", verdict, BAD if odd else GOOD,
                    tuple(sections))


def _units(fleet: Fleet) -> Table:
    odd = fleet.odd()
    rows = [(Link(robot, f"{robot}.html"),
             join_words(fleet.title(*cause) for cause in fleet.causes[robot]) or "no cause",
             "; ".join(odd.get(robot, ())) or "-") for robot in fleet.robots]
    marks = [UNSURE if robot in odd else GOOD for robot in fleet.robots]
    return Table(("unit", "causes", "odd about it"), tuple(rows), marks=tuple(marks))


def _parameters(fleet: Fleet) -> Table:
    rows = []
    for one in fleet.parameters:
        varies = one.common
        rows.append((fleet.name_of(one),
                     f"{number(varies.mean, 4)} +- {number(varies.half, 2)}",
                     number(varies.between_units, 2) if varies.units_differ else "-",
                     number(varies.between_logs, 2) if varies.logs_differ else "-",
                     one.unit, join_words(one.odd) or "-"))
    return Table(("parameter", "common value", "differs by unit", "differs by log", "unit", "odd"),
                 tuple(rows), "Differences are standard deviations; a dash where the intervals of "
                 "the fits explain all of it.",
                 tuple(UNSURE if one.odd else "" for one in fleet.parameters))


def _drawn(fleet: Fleet) -> list[FleetParameter]:
    """Parameters that are drawn: of causes and those that differ, odd ones first."""
    shown = [one for one in fleet.parameters
             if one.odd or one.effect != JOINT_MODEL or one.common.units_differ]
    return sorted(shown, key=lambda one: not one.odd)[:MOST_PANELS]


def _figure(fleet: Fleet, shown: list[FleetParameter]) -> Figure:
    from matplotlib.figure import Figure

    rows = -(-len(shown) // COLUMNS)
    figure = Figure(figsize=(9.0, 2.4 * rows), layout="constrained")
    for k, one in enumerate(shown):
        _panel(figure.add_subplot(rows, COLUMNS, k + 1), fleet, one)
    return figure


def _panel(axes: Axes, fleet: Fleet, one: FleetParameter) -> None:
    varies = one.common
    axes.axhspan(varies.mean - varies.half, varies.mean + varies.half, color=BAND)
    for k, robot in enumerate(one.robots):
        value, deviation = one.logs[robot]
        place = k + 0.25 * (np.arange(len(value)) - (len(value) - 1) / 2) / max(len(value) - 1, 1)
        axes.errorbar(place, value, 1.96 * deviation, fmt="o", ms=3, lw=1,
                      color=ODD_POINT if robot in one.odd else POINT)
    axes.set_xticks(range(len(one.robots)), one.robots, rotation=60, fontsize=7)
    axes.set_title(fleet.name_of(one), fontsize=8)
    axes.set_ylabel(one.unit, fontsize=8)
    axes.tick_params(axis="y", labelsize=7)
    axes.margins(x=0.1)
