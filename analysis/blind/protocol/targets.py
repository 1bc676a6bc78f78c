"""What the diagnosis is meant to reach, beside what a study measured."""

TARGETS = (  # key, words, target, whether more is better
    ("top_1_medium_strong", "single effect right first, medium and strong", 0.92, True),
    ("top_1_mild", "single effect right first, mild", 0.80, True),
    ("top_3", "single effect among the first three", 0.97, True),
    ("joint", "right joint, effect found", 0.98, True),
    ("false_alarm", "false alarm on a healthy robot", 0.02, False),
    ("unknown_detected", "effect outside the library called unknown", 0.88, True),
    ("false_unknown", "known or nothing called unknown", 0.05, False),
    ("pair_all_in_top_2", "both of a pair in the first two", 0.65, True),
    ("set_coverage", "90 % set holds the truth", 0.90, True),
    ("set_size", "names in the 90 % set, mean", 1.5, False),
    ("ece", "expected calibration error", 0.05, False),
    ("against_true_model", "gap after a right diagnosis over the true model's, median", 1.05,
     False))
REACHED, OPEN, MISSED = "yes", "not shown", "no"


def judged(found):
    """Return one row per target: key, words, target, measured, interval, reached.

    Reached means that the measured figure is as good as the target; not shown, that it is worse
    but its interval reaches the target; missed, that even the interval does not.

    Parameters
    ----------
    found : dict
        From `score.score`.

    """
    rows = []
    for key, words, target, more in TARGETS:
        value, interval, of = _measured(found, key)
        if value is None:
            continue
        best = interval[1] if more else interval[0]
        reached = (REACHED if _as_good(value, target, more)
                   else OPEN if _as_good(best, target, more) else MISSED)
        rows.append({"key": key, "words": words, "target": target, "more_is_better": more,
                     "measured": value, "interval": interval, "of": of, "reached": reached})
    return rows


def _measured(found, key):
    held = found["calibration"]["ece"] if key == "ece" else found[key]
    value = next((held[name] for name in ("rate", "median", "value") if name in held), None)
    return value, held["interval"], held["of"]


def _as_good(value, target, more):
    return value >= target if more else value <= target
