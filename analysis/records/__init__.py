"""Records: logs of real robots, read into one form with every decision written down."""

_HOME = {
    "Record": "model",
    "Robot": "robot",
    "read_robot": "robot_file",
    "read_record": "read",
    "read_records": "read",
    "read_trial": "read",
    "write_record": "write",
    "align": "resampling",
    "resample": "resampling",
}

__all__ = list(_HOME)


def __getattr__(name):
    """Import a public name on first use, so that start-up stays fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
