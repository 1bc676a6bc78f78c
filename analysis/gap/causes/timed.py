"""Causes that depend on time: a periodic disturbance, and a fault that sets in."""

from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    BodyTerms,
    Cause,
    EffectValues,
    FrictionLimits,
    Memory,
    Number,
    Probe,
    Scene,
    Values,
    cause_of,
)
from clie_blocks.analysis.gap.causes.load import tip_mass
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY
from clie_blocks.robot_loop.dynamics import Piece, State


def _no_probes(scene: Scene) -> list[Probe]:
    """None: `search.events` finds the frequencies and the moments."""
    return []


PERIODIC_DISTURBANCE = cause_of(
    LIBRARY["periodic_disturbance"], ("sine", "cosine", "frequency"), _no_probes,
    per_log=("sine", "cosine"), phase=("frequency",), within={"frequency": (0.05, 40.0)})


def _after(s: State, p: Values) -> np.ndarray:
    return np.where(s.t >= p["onset"], 1.0, 0.0)


def _step_load(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    return _after(s, p) * p["torque"], z


def _step_damping(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    return _after(s, p) * p["damping"] * s.dq, z


def _step_friction(s: State, z: Memory, p: Values) -> tuple[FrictionLimits, Memory]:
    level = _after(s, p) * p["level"]
    return (level, level), z


def _step_payload(s: State, p: Values) -> BodyTerms:
    own, cross, torque = tip_mass(s)
    mass = _after(s, p) * p["mass"]
    return mass * own, mass * cross, mass * torque


_ONSET = Number("onset", "s", 0.0, scope="log", fixed=True, neutral=1e9)


def _fault(variant: str, size: str, parameter: str) -> Callable[[Problem, Values], EffectValues]:
    """A fault with the name that the size of one of its kinds has in the catalogue.

    One that a log does not show sets in when all is over.
    """
    def of_effect(problem: Problem, values: Values) -> EffectValues:
        latest = next(p.upper for p in LIBRARY["step_fault"].parameters if p.name == "time")
        return {"step_fault": {
            parameter: values[f"step_fault_{variant}.{size}"],
            "time": np.minimum(values[f"step_fault_{variant}.onset"], latest)}}
    return of_effect


STEP_FAULT = (
    Cause("step_fault", (Piece("load", _step_load),),
          (Number("torque", "N m"), _ONSET), _no_probes, variant="torque",
          of_effect=_fault("torque", "torque", "offset")),
    Cause("step_fault", (Piece("load", _step_damping),),
          (Number("damping", "N m s/rad"), _ONSET), _no_probes, variant="damping",
          of_effect=_fault("damping", "damping", "viscous")),
    Cause("step_fault", (Piece("friction", _step_friction),),
          (Number("level", "N m", 0.0), _ONSET), _no_probes, variant="friction",
          of_effect=_fault("friction", "level", "coulomb")),
    Cause("step_fault", (Piece("body", _step_payload),),
          (Number("mass", "kg", scope="robot"), _ONSET), _no_probes, variant="payload",
          needs_links=True, of_effect=lambda problem, values: {}),
)
