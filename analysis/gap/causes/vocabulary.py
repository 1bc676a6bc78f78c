"""The names that a diagnosis of logs can give: what is searched for, and how a choice is made."""

import difflib
import textwrap
from collections.abc import Collection

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError

# The stated law, replayed on the logged signals, shows these without a model of the robot.
FOUND_BY_REPLAY = (
    "velocity_filter_mismatch", "encoder_quantization", "gain_error", "control_law_form",
    "hidden_integral", "hidden_compensation", "setpoint_slew", "setpoint_delay", "in_loop_delay",
    "velocity_estimate_lag", "channel_skew", "sensor_gain")
EFFECT_NAMES = frozenset(cause.name for cause in CAUSES) | frozenset(FOUND_BY_REPLAY)


def searched_effects() -> tuple[str, ...]:
    """Names of the effects that a diagnosis of logs searches for, in alphabetical order.

    They are a part of the catalogue, `clie_blocks.effects.LIBRARY`: the other effects can be
    simulated and drawn, but a diagnosis names none of them.
    """
    return tuple(sorted(EFFECT_NAMES))


def select_causes(effects: Collection[str], exclude: Collection[str]) -> tuple[Cause, ...]:
    """Return the causes to search for: those of `effects` (all when empty) but not of `exclude`.

    Raises
    ------
    ClieError
        For an effect that is not searched for; says whether the catalogue knows it.

    """
    for name in (*effects, *exclude):
        if name not in EFFECT_NAMES:
            raise ClieError(_not_searched(name))
    return tuple(cause for cause in CAUSES
                 if (not effects or cause.name in effects) and cause.name not in exclude)


def _not_searched(name: str) -> str:
    names = searched_effects()
    if name in LIBRARY:
        problem = (f"{name} is in the catalogue (clie effects {name}), but no log diagnosis "
                   "searches for it yet")
    else:
        close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
        problem = f"no effect is called {name!r}" + (
            f"; did you mean {close[0]!r}?" if close else "")
    listed = textwrap.fill(", ".join(names), 90, initial_indent="  ", subsequent_indent="  ")
    return f"{problem}\nsearched for:\n{listed}"


def excluded_names(effects: Collection[str], exclude: Collection[str]) -> frozenset[str]:
    """Effects that are not to be named: the excluded ones, and what a choice of effects omits."""
    return frozenset(exclude) | (EFFECT_NAMES - set(effects) if effects else frozenset())
