"""A diagram as one machine-code program: the names to use, imported when first asked for."""

import importlib

_HOME = {
    "compile_diagram": "program",
    "Program": "program",
    "Batch": "runtime.batch",
    "Derivatives": "runtime.sensitivities",
    "Stop": "runtime.events",
    "sampled": "sampled.loop",
    "SampledProgram": "sampled.loop",
    "held_normal": "runtime.inputs",
    "TraceError": "ir.symbols",
    "OpaqueBlockWarning": "frontend.callback_cost",
    "InputError": "runtime.inputs",
    "CompiledDifferenceError": "verification",
    "METHODS": "runtime.methods",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__():
    return __all__
