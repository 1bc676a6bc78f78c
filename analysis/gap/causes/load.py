"""Causes that depend on the pose or on the mass that is moved."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    BodyTerms,
    Cause,
    EffectValues,
    Memory,
    Number,
    Probe,
    Scene,
    Values,
    cause_of,
)
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY
from clie_blocks.robot_loop import planar_chain
from clie_blocks.robot_loop.dynamics import Piece, State, split_mass

SPRING = cause_of(
    LIBRARY["spring"], ("stiffness",),
    lambda scene: [Probe({"stiffness": scene.small_torque() / scene.travel}, ("stiffness",))],
    held={"hardening": 0.0}, frees=("load",))


def _counterbalance_probes(scene: Scene) -> list[Probe]:
    """Springs that are shortest in a few directions, slack or drawn to a point."""
    size = scene.small_torque()
    return [Probe({"moment": size, "slack": slack + 0 * size, "angle": angle + 0 * size},
                  ("moment",), {"angle": 0.1 + 0 * size})
            for slack in (0.4, 0.8) for angle in np.linspace(-np.pi, np.pi, 8, endpoint=False)]


COUNTERBALANCE = cause_of(
    LIBRARY["counterbalance"], ("moment", "slack", "angle"), _counterbalance_probes,
    frees=("load",))


def _stop_probes(scene: Scene) -> list[Probe]:
    """Stops that shorten the travel at its upper end, at its lower end, and at both."""
    size = scene.small_torque()
    course = np.concatenate([log.q for log in scene.problem.fit])
    first, last, never = course.min(axis=0), course.max(axis=0), 10.0 + 0 * size
    return [Probe({"stiffness": size / (share * scene.travel), "damping": 0.0 * size,
                   "lower": first + share * scene.travel if below else -never,
                   "upper": last - share * scene.travel if above else never},
                  ("stiffness",), {"lower": 0.02 * scene.travel, "upper": 0.02 * scene.travel,
                                   "damping": 0.3 / scene.top_speed})
            for share in (0.02, 0.05, 0.1, 0.17, 0.25, 0.35, 0.45)
            for below, above in ((False, True), (True, False), (True, True))]


SOFT_STOP = cause_of(
    LIBRARY["soft_stop"], ("stiffness", "lower", "upper", "damping"), _stop_probes)


def _tilted(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    upright = planar_chain.gravity_torque(s.chain, s.q) / s.ratio
    turned = planar_chain.gravity_torque(s.chain, s.q, np.pi / 2) / s.ratio
    return (np.cos(p["tilt"]) - 1.0) * upright + np.sin(p["tilt"]) * turned, z


def _tilt_probes(scene: Scene) -> list[Probe]:
    """A small tilt of a base whose links weigh in the nominal model."""
    if not scene.problem.chain.has_gravity:
        return []
    return [Probe({"tilt": 0.01 + 0 * scene.torque}, ("tilt",))]


BASE_TILT = Cause("base_tilt", (Piece("load", _tilted),),
                  (Number("tilt", "rad", -0.6, 0.6, scope="robot"),), _tilt_probes,
                  needs_links=True, of_effect=lambda problem, values: {"base_tilt": {
                      "tilt": values["base_tilt.tilt"], **_weights(problem)}})


def _weights(problem: Problem, share: float = 1.0) -> dict[str, np.ndarray]:
    """A share of the weight of the links as effects of the catalogue state it.

    Without links it is the weight of one joint, motor side.
    """
    if not problem.chain.known:
        return {"weight": share + np.zeros(problem.n), "gear_ratio": np.ones(problem.n)}
    return {"weight": share * np.array(planar_chain.weights(problem.chain)),
            "gear_ratio": problem.gear_ratio}


def _gravity(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    if s.chain.known:
        upright = planar_chain.gravity_torque(s.chain, s.q) / s.ratio
        turned = planar_chain.gravity_torque(s.chain, s.q, np.pi / 2) / s.ratio
    else:
        upright, turned = np.cos(s.q), -np.sin(s.q)
    return p["along"] * upright + p["across"] * turned, z


def _gravity_probes(scene: Scene) -> list[Probe]:
    chain, ratio = scene.problem.chain, scene.problem.gear_ratio
    if not chain.known:
        size = np.min(scene.small_torque()) + 0 * scene.torque  # one value for all joints
        return [Probe({"along": size, "across": size}, ("along", "across"))]
    stretched = planar_chain.gravity_torque(chain, np.zeros((1, chain.n)))[0] / ratio
    share = np.min(0.03 * scene.torque / np.maximum(stretched, 1e-12)) + 0 * scene.torque
    return [Probe({"along": share, "across": share}, ("along", "across"))]


def _gravity_effects(problem: Problem, values: Values) -> EffectValues:
    """A weight, and the tilt that turns it."""
    along, across = values["gravity.along"][0], values["gravity.across"][0]
    share = np.copysign(np.hypot(along, across), along)
    weight = _weights(problem, share)
    tilt = np.arctan(across / along) + np.zeros(problem.n) if along else np.full(
        problem.n, np.pi / 2)
    return {"gravity": weight, "base_tilt": {"tilt": tilt, **weight}}


GRAVITY = Cause(
    "gravity", (Piece("load", _gravity),),
    (Number("along", "1", scope="robot"), Number("across", "1", scope="robot")),
    _gravity_probes, of_effect=_gravity_effects)


def tip_mass(s: State) -> BodyTerms:
    """Own mass, shared mass and torque of 1 kg at the tip, motor side."""
    unit = planar_chain.unit_tip_chain(s.chain)
    own, cross = split_mass(planar_chain.mass_matrix(unit, s.q))
    torque = planar_chain.coriolis_torque(unit, s.q, s.dq)
    if s.chain.has_gravity:
        torque = torque + planar_chain.gravity_torque(unit, s.q)
    return own / s.ratio, cross / s.ratio, torque / s.ratio


def _payload(s: State, p: Values) -> BodyTerms:
    own, cross, torque = tip_mass(s)
    return p["mass"] * own, p["mass"] * cross, p["mass"] * torque


def _payload_probes(scene: Scene) -> list[Probe]:
    reach = scene.problem.chain.length.sum()
    mass = np.min(0.03 * scene.inertia * scene.problem.gear_ratio) / reach**2
    return [Probe({"mass": mass + 0 * scene.torque}, ("mass",))]


def _payload_effect(problem: Problem, values: Values) -> EffectValues:
    """A mass that weighs; on an arm whose links do not, no effect of the catalogue is the same."""
    if not problem.chain.has_gravity:
        return {}
    return {"payload": {"mass": values["payload.mass"], "length": problem.chain.length,
                        "gear_ratio": problem.gear_ratio}}


PAYLOAD = Cause("payload", (Piece("body", _payload),),
                (Number("mass", "kg", 0.0, scope="robot"),), _payload_probes, needs_links=True,
                of_effect=_payload_effect)


def _coupling(s: State, p: Values) -> BodyTerms:
    own, cross = split_mass(planar_chain.mass_matrix(s.chain, s.q))
    torque = planar_chain.coriolis_torque(s.chain, s.q, s.dq)
    return (p["share"] * (own - s.chain.diagonal) / s.ratio, p["share"] * cross / s.ratio,
            p["share"] * torque / s.ratio)


def _coupling_probes(scene: Scene) -> list[Probe]:
    """Whole coupling of the stated links, where the nominal model leaves it out."""
    if scene.problem.n < 2 or scene.problem.chain.has_coupling:
        return []
    return [Probe({"share": 1.0 + 0 * scene.torque})]


COUPLING = Cause("coupling", (Piece("body", _coupling),),
                 (Number("share", "1", scope="robot", fixed=True),), _coupling_probes,
                 needs_links=True, of_effect=lambda problem, values: {})
