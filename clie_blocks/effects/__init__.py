"""The catalogue of unmodelled effects: one file per effect, loaded when it is asked for.

``LIBRARY['coulomb'](level=0.3)`` sets an effect, ``with_effects(plant, [...])`` inserts it.
"""

from collections.abc import Mapping
from importlib import import_module

from clie_blocks.errors import ClieError, nearest

__all__ = ["LIBRARY", "with_effects"]

# Effect -> file; the order is that of the report.
_FILES = {
    "coulomb": "coulomb",
    "stribeck": "stribeck",
    "asymmetric_coulomb": "asymmetric_coulomb",
    "quadratic_drag": "quadratic_drag",
    "load_dependent_friction": "load_dependent_friction",
    "presliding": "presliding",
    "dahl": "presliding",
    "maxwell_slip": "maxwell_slip",
    "position_dependent_friction": "position_dependent_friction",
    "friction_drift": "friction_drift",
    "rest_time_breakaway": "rest_time_breakaway",
    "directional_efficiency": "directional_efficiency",
    "gravity": "gravity",
    "payload": "payload",
    "coupling": "coupling",
    "spring": "spring",
    "base_tilt": "base_tilt",
    "counterbalance": "counterbalance",
    "soft_stop": "soft_stop",
    "fluid_drag": "fluid_drag",
    "periodic_disturbance": "periodic_disturbance",
    "step_fault": "step_fault",
    "inertia": "mismatch",
    "viscous": "mismatch",
    "torque_gain": "mismatch",
    "offset": "mismatch",
}


class UnknownEffectError(ClieError, KeyError):
    """No effect of that name is in the catalogue."""

    __str__ = Exception.__str__


class Library(Mapping):
    """Effects by name, in the order of the report; a file is imported when its effect is read."""

    def __getitem__(self, name):
        if name not in _FILES:
            raise UnknownEffectError(f"no effect is called {name!r}; {nearest(name, _FILES)}")
        return getattr(import_module(f"{__name__}.{_FILES[name]}"), name.upper())

    def __contains__(self, name):
        return name in _FILES

    def __iter__(self):
        return iter(_FILES)

    def __len__(self):
        return len(_FILES)


LIBRARY = Library()


def __getattr__(name):
    if name == "with_effects":
        return import_module(f"{__name__}.insertion").with_effects
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
