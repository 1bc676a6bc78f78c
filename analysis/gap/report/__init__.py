"""The report of a diagnosis: one HTML page, its JSON, and the numbers for a simulator."""

import importlib

_HOME = {"corrected_model": "exports", "document": "document", "write_report": "files"}

__all__ = sorted(_HOME)


def __getattr__(name):
    """Import a public name on first use, so that start-up stays fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
