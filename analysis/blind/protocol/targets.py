"""What the diagnosis is meant to reach, next to what a study measured."""

from collections.abc import Sequence
from typing import Any

Target = tuple[str, str, float, bool]  # key, words, target, whether more is better
TARGETS: tuple[Target, ...] = (
    ("top_1_medium_strong", "single effect ranked first, medium and strong", 0.92, True),
    ("top_1_mild", "single effect ranked first, mild", 0.80, True),
    ("top_3", "single effect among the first three", 0.97, True),
    ("joint", "right joint, where the effect is right", 0.98, True),
    ("false_alarm", "false alarm on a healthy robot", 0.02, False),
    ("unknown_detected", "effect outside the library reported as unknown", 0.88, True),
    ("false_unknown", "known effect or none reported as unknown", 0.05, False),
    ("pair_all_in_top_2", "both effects of a pair ranked first", 0.65, True),
    ("set_coverage", "90 % set contains the truth", 0.90, True),
    ("set_size", "size of the 90 % set, mean", 1.5, False),
    ("ece", "expected calibration error", 0.05, False),
    ("against_true_model", "gap after a right diagnosis, relative to the true model, median",
     1.05, False))
CATALOGUE_TARGETS: tuple[Target, ...] = (  # of the study of the whole catalogue, over classes
    ("top_1", "single effect, right class first", 0.90, True),
    ("top_1_medium_strong", "the same, medium and strong", 0.93, True),
    ("top_3", "right class among the first three", 0.98, True),
    ("joint", "right joint, where the class is right", 0.98, True),
    ("false_alarm", "false alarm on a healthy robot", 0.01, False),
    ("newcomer_named", "effect of the standard study called by another study's name", 0.02, False),
    ("unknown_detected", "effect outside the catalogue reported as unknown", 0.90, True),
    ("set_coverage", "90 % set contains the truth", 0.90, True),
    ("set_size", "classes in the 90 % set, mean", 1.5, False),
    ("ece", "expected calibration error", 0.05, False))
ARMS_TARGETS: tuple[Target, ...] = (  # of the study of arms in space, over classes
    ("top_1_medium_strong", "single effect, right class first, medium and strong", 0.92, True),
    ("joint", "right joint, where the class is right", 0.97, True),
    ("false_alarm", "false alarm on a sound arm", 0.02, False),
    ("unknown_detected", "effect outside the catalogue reported as unknown", 0.88, True),
    ("set_coverage", "90 % set contains the truth", 0.95, True),
    ("ece", "expected calibration error", 0.05, False))
REACHED, OPEN, MISSED = "yes", "not shown", "no"


def compare_with_targets(board: dict[str, Any],
                         targets: Sequence[Target] = TARGETS) -> list[dict[str, Any]]:
    """Return the rows of `compare` for a scoreboard of `score.score`."""
    return compare({**board, "ece": board["calibration"]["ece"]}, targets)


def compare(figures: dict[str, Any], targets: Sequence[Target]) -> list[dict[str, Any]]:
    """Return one row per target: key, words, target, measured, interval, reached.

    Reached means that the measured figure is as good as the target; not shown, that it is worse
    but its interval reaches the target; missed, that even the interval does not.

    Parameters
    ----------
    figures : dict
        Figures with their intervals, see `scoring.intervals`.
    targets : sequence of tuple
        Key of a figure, words, target, whether more is better.

    """
    rows = []
    for key, words, target, more in targets:
        held = figures[key]
        value = next((held[name] for name in ("rate", "median", "value") if name in held), None)
        if value is None:
            continue
        best = held["interval"][1 if more else 0]
        reached = (REACHED if _as_good(value, target, more)
                   else OPEN if _as_good(best, target, more) else MISSED)
        rows.append({"key": key, "words": words, "target": target, "more_is_better": more,
                     "measured": value, "interval": held["interval"], "of": held["of"],
                     "reached": reached})
    return rows


def _as_good(value: float, target: float, more: bool) -> bool:
    return value >= target if more else value <= target
