"""The library: effects by name, in the order of the report; one file per effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

from clie_blocks.errors import ClieError, nearest

if TYPE_CHECKING:
    from clie_blocks.effects.effect import Effect

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
    "joint_elasticity": "joint_elasticity",
    "stiffening_elasticity": "stiffening_elasticity",
    "backlash": "backlash",
    "torsional_hysteresis": "torsional_hysteresis",
    "kinematic_error": "kinematic_error",
    "gear_mesh_ripple": "gear_mesh_ripple",
    "coupled_joints": "coupled_joints",
    "ratio_error": "ratio_error",
    "actuator_saturation": "actuator_saturation",
    "torque_speed_limit": "torque_speed_limit",
    "dead_zone": "dead_zone",
    "actuator_lag": "actuator_lag",
    "torque_ripple": "torque_ripple",
    "commutation_ripple": "commutation_ripple",
    "torque_gain_error": "torque_gain_error",
    "back_emf": "back_emf",
    "supply_sag": "supply_sag",
    "motor_heating": "motor_heating",
    "torque_quantization": "torque_quantization",
    "torque_slew": "torque_slew",
    "setpoint_slew": "setpoint_slew",
    "time_delay": "time_delay",
    "setpoint_delay": "setpoint_delay",
    "in_loop_delay": "in_loop_delay",
    "tick_jitter": "tick_jitter",
    "packet_hold": "packet_hold",
    "velocity_filter_mismatch": "velocity_filter_mismatch",
    "gain_error": "gain_error",
    "control_law_form": "control_law_form",
    "hidden_integral": "hidden_integral",
    "hidden_compensation": "hidden_compensation",
    "encoder_quantization": "encoder_quantization",
    "encoder_eccentricity": "encoder_eccentricity",
    "encoder_offset": "encoder_offset",
    "velocity_estimate_lag": "velocity_estimate_lag",
    "channel_skew": "channel_skew",
    "sensor_gain": "sensor_gain",
    "periodic_disturbance": "periodic_disturbance",
    "step_fault": "step_fault",
    "inertia": "mismatch",
    "viscous": "mismatch",
    "torque_gain": "mismatch",
    "offset": "mismatch",
}
TERM = "torque_term"


class UnknownEffectError(ClieError, KeyError):
    """No effect of that name is in the catalogue."""

    __str__ = Exception.__str__


class Library(Mapping):
    """Effects by name, in the order of the report; a file is imported when its effect is read."""

    def __init__(self) -> None:
        self.registered: dict[str, Effect] = {}

    def __getitem__(self, name: str) -> Effect:
        if name in self.registered:
            return self.registered[name]
        if name not in _FILES:
            raise UnknownEffectError(f"no effect is called {name!r}; {nearest(name, [*self])}")
        return getattr(import_module(f"clie_blocks.effects.{_FILES[name]}"), name.upper())

    def __contains__(self, name: object) -> bool:
        return name in _FILES or name in self.registered

    def __repr__(self) -> str:
        return f"<library of {len(self)} effects: {', '.join([*self][:4])}, ...>"

    def __iter__(self) -> Iterator[str]:
        return iter([*_FILES, *self.registered])

    def __len__(self) -> int:
        return len(_FILES) + len(self.registered)


LIBRARY = Library()


def effect_of(name: str) -> Effect:
    """Return an effect of the catalogue, or the term of a formula, which is none of it.

    Such a term, `clie_blocks.effects.torque_term`, names no cause, so that no list holds it.

    Raises
    ------
    UnknownEffectError
        For another name; names the nearest one.

    """
    if name == TERM:
        term: Effect = import_module("clie_blocks.effects.torque_term").TORQUE_TERM
        return term
    return LIBRARY[name]
