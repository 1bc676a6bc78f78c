"""Names, numbers and units as the report writes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.verdict.confounders import CONTACT, POSE, UNMARKED

if TYPE_CHECKING:
    from clie_blocks.analysis.records import Record

Answer = Mapping[str, Any]  # the JSON answer
Row = Mapping[str, Any]  # of one effect in it
Units = Mapping[str, str]  # of positions ``q`` and commands ``u``

MIXED = " or "  # between the units of joints that turn and of joints that slide
TITLES = {"none": "no effect", "unknown": "an effect outside the library",
          "parametric": "parameters outside their tolerance"}
JOINT_PARAMETERS = {"load": "offset",  # parameters of the joint model, for a reader
                    "torque": "torque over that of the robot file"}
CONFOUNDERS = {CONTACT: "an obstacle", POSE: "another torque of the pose",
               UNMARKED: "an effect outside the library"}

CLOSED_LOOP, RECORDED_COMMAND, WITH_OBSERVER = (
    "closed loop", "recorded command", "recorded command with an observer")


def effect_title(name: str) -> str:
    """Name of an effect for a reader: ``actuator_lag`` is 'actuator lag'."""
    return TITLES.get(name, name.replace("_", " "))


def number(value: float | None, digits: int = 3) -> str:
    """A number with as many digits as carry meaning; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{value:.{digits}g}"


def percent(share: float) -> str:
    """A share in percent, never '0' or '100' for what is neither."""
    if 0.0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1.0:
        return "> 99 %"
    return f"{100.0 * share:.0f} %"


def with_prefix(value: float | None, unit: str) -> str:
    """A small length or angle with the prefix that it is read in; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "-"
    factor, prefixed = display_scale(value, unit)
    return f"{value * factor:.3g} {prefixed}"


def display_scale(value: float, unit: str) -> tuple[float, str]:
    """Factor and unit, with its prefix, in which values of a size are read."""
    if MIXED in unit:
        return 1.0, unit
    for factor, prefix in ((1.0, ""), (1e3, "m")):
        if abs(value) * factor >= 1.0:
            return factor, prefix + unit
    return 1e6, f"u{unit}"


def join_words(words: Iterable[str], last: str = "and") -> str:
    """Join words: 'a', 'a and b', 'a, b and c'."""
    words = list(words)
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def local_unit(unit: str, units: Units) -> str:
    """Unit of a parameter for a machine that is not in rad and N m, such as an axis in m."""
    q, u = units["q"], units["u"]
    if unit == "1/turn":
        return unit if q == "rad" else f"rad/{q}"
    if u != "N m":
        unit = unit.replace("kg m^2", "kg" if (q, u) == ("m", "N") else "N m s^2/rad")
    unit = unit.replace("N m", u).replace("rad", q)
    return _cancelled(unit, q) if u == q else unit


def _cancelled(unit: str, q: str) -> str:
    """Unit in which a position stands above and below the line, as for a servo's error."""
    for above, below in ((f"{q} s^2/{q}", "s^2"), (f"{q} s/{q}", "s"), (f"{q}/{q}", "1")):
        unit = unit.replace(above, below)
    return unit


def effort(units: Units) -> str:
    """What a command in a unit is called: a torque, a force, or just a command."""
    return {"N m": "torque", "N": "force"}.get(units["u"], "command")


def units_of(records: Sequence[Record]) -> Units:
    """Units of positions and commands, of all joints; rad and N m without records."""
    if not records:
        return {"q": "rad", "u": "N m"}
    return {name: MIXED.join(dict.fromkeys(records[0].units[name])) for name in ("q", "u")}
