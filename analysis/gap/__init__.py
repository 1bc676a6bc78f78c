"""The sim-to-real gap: where a model is wrong, which effect causes it, how far the gap shrinks.

One stage per file, in the order in which `diagnose` runs them: controller check, baseline,
screening, candidates, fit, verdict, shrinkage.
"""

import importlib

_HOME = {
    "Calibration": "verdict",
    "Diagnosis": "pipeline",
    "answer": "json_answer",
    "diagnose": "pipeline",
    "write_report": "report",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    """Import a public name on first use, so that start-up stays fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
