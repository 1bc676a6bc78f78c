"""The diagnosis of one robot: all stages in their order."""

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.errors import ClieError, nearest

FOUND_BY_REPLAY = ("velocity_filter_mismatch", "encoder_quantization")
EFFECT_NAMES = frozenset(cause.name for cause in CAUSES) | frozenset(FOUND_BY_REPLAY)


def select_causes(effects, exclude):
    """Return the causes to look for.

    Raises
    ------
    ClieError
        For a name that is not in the vocabulary.

    """
    for name in (*effects, *exclude):
        if name not in EFFECT_NAMES:
            raise ClieError(
                f"no effect is called {name!r}; {nearest(name, sorted(EFFECT_NAMES))}")
    return tuple(cause for cause in CAUSES
                 if (not effects or cause.name in effects) and cause.name not in exclude)


def excluded_names(effects, exclude):
    """Effects that are not to be named: the excluded ones, and what a choice of effects lacks."""
    return frozenset(exclude) | (EFFECT_NAMES - set(effects) if effects else frozenset())
