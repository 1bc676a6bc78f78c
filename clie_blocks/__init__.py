"""Closed-loop input error identification of robot joints, as python-control block diagrams.

The names below are imported when they are first used, so that ``import clie_blocks`` is fast.
"""

import importlib

__version__ = "0.1.0"

_HOME = {
    "pd_controller": "controllers",
    "linearizing_controller": "controllers",
    "decoupled_joints": "joints",
    "inertial_joints": "joints",
    "estimated_model": "joints",
    "motor_side": "joints",
    "normalised": "joints",
    "two_link_arm": "manipulator",
    "velocity_filter": "filters",
    "lowpass": "filters",
    "lowpass_with_rate": "filters",
    "encoder": "measurement",
    "noisy_measurement": "measurement",
    "source": "excitation",
    "regressor": "identification",
    "filtered_regressor": "identification",
    "identification_error": "identification",
    "gradient_update": "identification",
    "composite_update": "identification",
    "interconnect": "signals",
    "summing": "signals",
    "compile_diagram": "compiled",
    "held_normal": "compiled",
    "clie_loop": "diagrams.clie_loop",
    "clie_composite": "diagrams.clie_composite",
    "joint_loop": "diagrams.joint_loop",
    "feedback_linearization": "diagrams.feedback_linearization",
    "draw": "diagrams.picture",
}

__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__():
    return [*globals(), *__all__]
