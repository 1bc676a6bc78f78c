"""Causes that oppose the motion."""

from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    Cause,
    FrictionLimits,
    Memory,
    Number,
    Probe,
    Scene,
    Values,
)
from clie_blocks.robot_loop import planar_chain
from clie_blocks.robot_loop.dynamics import Piece, State


def _coulomb(s: State, p: Values) -> FrictionLimits:
    return p["level"], p["level"]


COULOMB = Cause(
    "coulomb", (Piece("friction", _coulomb),), (Number("level", "N m", 0.0),),
    lambda scene: [Probe({"level": scene.small_torque()}, ("level",))])


def _stribeck(s: State, p: Values) -> FrictionLimits:
    ratio = s.dq / p["speed"]
    level = p["level"] + p["excess"] * np.exp(-ratio * ratio)
    return level, level


def _stribeck_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "excess": size, "speed": speed * np.ones_like(size)},
                  ("level", "excess")) for speed in (0.01, 0.02, 0.04, 0.08, 0.16)]


STRIBECK = Cause(
    "stribeck", (Piece("friction", _stribeck),),
    (Number("level", "N m", 0.0), Number("excess", "N m", 0.0),
     Number("speed", "rad/s", 2e-3, 1.0, neutral=None)), _stribeck_probes,
    without=("coulomb", "excess"))


def _asymmetric(s: State, p: Values) -> FrictionLimits:
    return p["forward"], p["backward"]


ASYMMETRIC_COULOMB = Cause(
    "asymmetric_coulomb", (Piece("friction", _asymmetric),),
    (Number("forward", "N m", 0.0), Number("backward", "N m", 0.0)),
    lambda scene: [Probe({"forward": scene.small_torque(), "backward": scene.small_torque()},
                         ("forward", "backward"))],
    even=("coulomb", "forward", "backward"))


def _quadratic(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    return p["drag"] * s.dq * np.abs(s.dq), z


QUADRATIC_DRAG = Cause(
    "quadratic_drag", (Piece("load", _quadratic),), (Number("drag", "N m s^2/rad^2", 0.0),),
    lambda scene: [Probe({"drag": scene.small_torque() / scene.speed**2}, ("drag",))])


def _of_motor(s: State, p: Values) -> FrictionLimits:
    level = p["level"] + p["slope"] * np.abs(s.u)
    return level, level


def _of_links(s: State, p: Values) -> FrictionLimits:
    """Load that the gear carries: weight and velocity torque of the links, motor side."""
    load = planar_chain.coriolis_torque(s.chain, s.q, s.dq) / s.ratio
    if s.chain.has_gravity:
        load = load + planar_chain.gravity_torque(s.chain, s.q) / s.ratio
    level = p["level"] + p["slope"] * np.abs(load)
    return level, level


def _load_probes(scene: Scene) -> list[Probe]:
    return [Probe({"level": scene.small_torque(), "slope": 0.03 + 0 * scene.torque},
                  ("level", "slope"))]


def _load_dependent(act: Callable[[State, Values], FrictionLimits], variant: str = "",
                    needs_links: bool = False) -> Cause:
    return Cause("load_dependent_friction", (Piece("friction", act),),
                 (Number("level", "N m", 0.0), Number("slope", "1", 0.0, 0.9)), _load_probes,
                 without=("coulomb", "slope"), variant=variant, needs_links=needs_links)


LOAD_DEPENDENT_FRICTION = (
    _load_dependent(_of_motor), _load_dependent(_of_links, variant="links", needs_links=True))


def _presliding(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    """LuGre with a constant level: bristles of a range, with a damping of their own."""
    (state,) = z
    travel = np.abs(s.dq) * s.h / p["range"]
    end = np.sign(s.dq)
    half = end + (state - end) * np.exp(-travel / 2)
    rate = s.dq / p["range"] * (1.0 - half * end)
    return (p["level"] * half + p["bristle_damping"] * rate,
            [end + (state - end) * np.exp(-travel)])


def _presliding_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "range": reach + 0 * size, "bristle_damping": 0.1 * size},
                  ("level", "bristle_damping"))
            for reach in (0.001, 0.003, 0.008, 0.02, 0.05, 0.12)]


PRESLIDING = Cause(
    "presliding", (Piece("load", _presliding, states=1),),
    (Number("level", "N m", 0.0), Number("bristle_damping", "N m s", 0.0),
     Number("range", "rad", 1e-4, 0.5, neutral=None)), _presliding_probes)


def _warming(s: State, p: Values) -> np.ndarray:
    return 1.0 - np.exp(-(s.t + p["since"]) / p["time"])


def _drifting_drag(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    return p["damping"] * s.dq * _warming(s, p), z


def _drifting_level(s: State, p: Values) -> FrictionLimits:
    level = np.maximum(p["level"] + p["change"] * _warming(s, p), 0.0)
    return level, level


def _times(scene: Scene) -> list[tuple[float, np.ndarray]]:
    """Time constants, with the clock started anew in each log or running through all logs."""
    logs = scene.problem.logs
    running = np.cumsum([0.0] + [len(log) * scene.problem.period for log in logs[:-1]])
    shape = (len(logs), scene.problem.n)
    anew = np.zeros(shape)
    through = np.broadcast_to(running[:, None], shape)
    return [(t, since) for t in (4.0, 12.0, 40.0) for since in (anew, through)]


_CLOCK = (Number("time", "s", 1.0, 300.0, neutral=None),
          Number("since", "s", scope="log", fixed=True, neutral=None))
FRICTION_DRIFT = (
    Cause("friction_drift", (Piece("load", _drifting_drag),),
          (Number("damping", "N m s/rad"), *_CLOCK),
          lambda scene: [Probe({"damping": scene.small_torque() / scene.speed,
                                "time": t + 0 * scene.torque, "since": since}, ("damping",))
                         for t, since in _times(scene)], variant="viscous"),
    Cause("friction_drift", (Piece("friction", _drifting_level),),
          (Number("level", "N m", 0.0), Number("change", "N m"), *_CLOCK),
          lambda scene: [Probe({"level": scene.small_torque(), "change": scene.small_torque(),
                                "time": t + 0 * scene.torque, "since": since},
                               ("level", "change")) for t, since in _times(scene)],
          variant="dry", without=("coulomb", "change")),
)
