"""The sim-to-real gap: where a model is wrong, which effect causes it, how far the gap shrinks.

One folder per stage, in the order in which `diagnose` runs them; a stage imports only stages
that stand before it.
"""

import importlib

STAGES = ("problem", "controller", "simulation", "causes", "residual", "fitting", "search",
          "verdict", "assessment", "report")

_HOME = {
    "Calibration": "method",
    "Diagnosis": "diagnosis",
    "answer": "report.answer",
    "diagnose": "diagnosis",
    "write_report": "report",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    """Import a public name on first use, so that start-up stays fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
