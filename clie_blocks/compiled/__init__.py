"""A diagram as one machine-code program: the names to use, imported when first asked for."""

import importlib

_HOME = {
    "compile_diagram": "program",
    "Program": "program",
    "Batch": "batch",
    "Derivatives": "sensitivities",
    "Stop": "events",
    "sampled": "sampled_loop",
    "SampledProgram": "sampled_loop",
    "held_normal": "inputs",
    "TraceError": "symbols",
    "OpaqueBlockWarning": "callback_cost",
    "InputError": "inputs",
    "CompiledDifferenceError": "selfcheck",
    "METHODS": "methods",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__():
    return __all__
