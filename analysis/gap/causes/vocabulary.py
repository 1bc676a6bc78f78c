"""The names that a diagnosis of logs can give: what is searched for, and how a choice is made."""

import difflib
import textwrap
from collections.abc import Collection, Mapping

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.description import PARAMETRIC
from clie_blocks.analysis.gap.causes.generic import generic_cause
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError

# The stated law, replayed on the logged signals, shows these without a model of the robot.
FOUND_BY_REPLAY = (
    "velocity_filter_mismatch", "encoder_quantization", "gain_error", "control_law_form",
    "hidden_integral", "hidden_compensation", "setpoint_slew", "setpoint_delay", "in_loop_delay",
    "velocity_estimate_lag", "channel_skew", "sensor_gain")
STATED_NUMBERS: Mapping[str, str] = {
    "inertia": "motor.inertia_kgm2", "viscous": "motor.viscous_friction_nms",
    "back_emf": "motor.viscous_friction_nms", "offset": "motor.torque_offset_tolerance_nm",
    "ratio_error": "motor.gear_ratio", "encoder_offset": "zero_rad"}
"""Effects that move a robot just as another number of its file would, and that number.

No log tells the two apart, so the answer is the number, under the name ``parametric``.
"""
TORQUE_CONSTANT = "motor.torque_constant_nm_a"
WITH_TOLERANCE: Mapping[str, str] = {"torque_gain_error": TORQUE_CONSTANT}
"""Effects that are another number of the file where that states its tolerance, and that number."""
SAME_PHYSICS: Mapping[str, str] = {"torque_gain": "torque_gain_error"}
"""Effects of the catalogue that are one effect under two names, and the name that is searched."""


def searched_causes() -> tuple[Cause, ...]:
    """Causes that the motion is searched for: of the catalogue, and of registered effects."""
    return (*CAUSES, *(generic_cause(effect) for effect in LIBRARY.registered.values()))


def effect_names() -> frozenset[str]:
    """Names of all effects that a diagnosis can give."""
    return frozenset({*(cause.name for cause in CAUSES), *FOUND_BY_REPLAY, *STATED_NUMBERS,
                      *SAME_PHYSICS, *LIBRARY.registered})


def class_of(name: str) -> str:
    """Name under which a diagnosis answers an effect: its own, or that of its class."""
    return PARAMETRIC if name in STATED_NUMBERS else SAME_PHYSICS.get(name, name)


def effects_of_number(key: str) -> tuple[str, ...]:
    """Effects that move a robot as a wrong number of its file does, by the number's key."""
    return tuple(sorted(name for name, number in {**STATED_NUMBERS, **WITH_TOLERANCE}.items()
                        if number == key))


def describe_answer(name: str) -> str:
    """How a diagnosis of logs answers an effect, in words."""
    if name in STATED_NUMBERS:
        return (f"{PARAMETRIC}: another {STATED_NUMBERS[name]} of the robot file moves a robot "
                "alike")
    if name in SAME_PHYSICS:
        return f"{SAME_PHYSICS[name]}: the same under another name"
    return f"{name}, " + ("from the logged commands" if name in FOUND_BY_REPLAY else
                          "from the motion")


def searched_effects() -> tuple[str, ...]:
    """Names of the effects that a diagnosis of logs searches for, in alphabetical order.

    They are all of the catalogue, `clie_blocks.effects.LIBRARY`.
    """
    return tuple(sorted(effect_names()))


def select_causes(effects: Collection[str], exclude: Collection[str]) -> tuple[Cause, ...]:
    """Return the causes to search for: those of `effects` (all when empty) but not of `exclude`.

    Raises
    ------
    ClieError
        For an effect that no one knows.

    """
    names = effect_names()
    for name in (*effects, *exclude):
        if name not in names:
            raise ClieError(_not_searched(name))
    chosen = {class_of(name) for name in effects}
    return tuple(cause for cause in searched_causes()
                 if (not effects or cause.name in chosen) and cause.name not in exclude)


def _not_searched(name: str) -> str:
    names = searched_effects()
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    problem = f"no effect is called {name!r}" + (
        f"; did you mean {close[0]!r}?" if close else "")
    listed = textwrap.fill(", ".join(names), 90, initial_indent="  ", subsequent_indent="  ")
    return f"{problem}\nsearched for:\n{listed}"


def excluded_names(effects: Collection[str], exclude: Collection[str]) -> frozenset[str]:
    """Effects that are not to be named: the excluded ones, and what a choice of effects omits."""
    return frozenset(exclude) | (effect_names() - set(effects) if effects else frozenset())
