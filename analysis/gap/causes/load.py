"""Causes that depend on the pose or on the mass that is moved."""

from typing import Any

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
from clie_blocks.robot_loop.dynamics import Piece, State, split_mass
from clie_blocks.robot_loop.links import (
    Links,
    bias_torque,
    coriolis_torque,
    gravity_torque,
    mass_rows,
    turn_gravity,
    unit_tip_links,
    weights,
)

_AXES = ("x", "y", "z")
_UPRIGHT = 0.7  # of gravity along z of a base that a tilt turns about x and y
_SMALL_GRAVITY = 0.1  # m/s^2

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
    upright = gravity_torque(s.links, s.q) / s.ratio
    turned = gravity_torque(turn_gravity(s.links), s.q) / s.ratio
    return (np.cos(p["tilt"]) - 1.0) * upright + np.sin(p["tilt"]) * turned, z


def _tilt_probes(scene: Scene) -> list[Probe]:
    """A small tilt of a base whose links weigh in the nominal model, in their plane."""
    if not (scene.problem.links.has_gravity and scene.problem.links.is_planar):
        return []
    return [Probe({"tilt": 0.01 + 0 * scene.torque}, ("tilt",))]


BASE_TILT = Cause("base_tilt", (Piece("load", _tilted),),
                  (Number("tilt", "rad", -0.6, 0.6, scope="robot"),), _tilt_probes,
                  needs_links=True, of_effect=lambda problem, values: {"base_tilt": {
                      "tilt": values["base_tilt.tilt"], **_weights(problem)}})


def _tilted_in_space(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    upright = gravity_torque(s.links, s.q) / s.ratio
    gravity = _under_a_tilt(s.links.gravity, p["tilt_x"][0], p["tilt_y"][0])
    return gravity_torque(s.links.with_gravity(gravity), s.q) / s.ratio - upright, z


def _under_a_tilt(gravity: np.ndarray, about_x: Any, about_y: Any) -> np.ndarray:
    """Gravity as a base sees it that is turned about x, then about y of the world."""
    x, y, z = gravity
    y, z = np.cos(about_x) * y - np.sin(about_x) * z, np.sin(about_x) * y + np.cos(about_x) * z
    return np.array([np.cos(about_y) * x + np.sin(about_y) * z, y,
                     np.cos(about_y) * z - np.sin(about_y) * x])


def _tilt_in_space_probes(scene: Scene) -> list[Probe]:
    """Small tilts about x and y of a base that stands upright or hangs."""
    links, zero = scene.problem.links, 0 * scene.torque
    upright = abs(links.gravity[2]) > _UPRIGHT * links.g
    if not links.has_gravity or links.is_planar or not upright:
        return []
    return [Probe({"tilt_x": 0.01 + zero, "tilt_y": 0.01 + zero}, ("tilt_x", "tilt_y"))]


BASE_TILT_IN_SPACE = Cause(
    "base_tilt", (Piece("load", _tilted_in_space),),
    tuple(Number(name, "rad", -0.6, 0.6, scope="robot") for name in ("tilt_x", "tilt_y")),
    _tilt_in_space_probes, variant="in_space", needs_links=True, of_effect=lambda *_: {})


def _weights(problem: Problem, share: float = 1.0) -> dict[str, np.ndarray]:
    """A share of the weight of the links as effects of the catalogue state it.

    Without links it is the weight of one joint, motor side.
    """
    if not problem.links.known:
        return {"weight": share + np.zeros(problem.n), "gear_ratio": np.ones(problem.n)}
    return {"weight": share * weights(problem.links),
            "gear_ratio": problem.gear_ratio}


def _gravity(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    if s.links.known:
        upright = gravity_torque(s.links, s.q) / s.ratio
        turned = gravity_torque(turn_gravity(s.links), s.q) / s.ratio
    else:
        upright, turned = np.cos(s.q), -np.sin(s.q)
    return p["along"] * upright + p["across"] * turned, z


def _gravity_probes(scene: Scene) -> list[Probe]:
    links, ratio = scene.problem.links, scene.problem.gear_ratio
    if links.known and not links.is_planar:
        return []
    if not links.known:
        size = np.min(scene.small_torque()) + 0 * scene.torque  # one value for all joints
        return [Probe({"along": size, "across": size}, ("along", "across"))]
    stretched = gravity_torque(links, np.zeros((1, links.n)))[0] / ratio
    share = np.min(0.03 * scene.torque / np.maximum(stretched, 1e-12)) + 0 * scene.torque
    return [Probe({"along": share, "across": share}, ("along", "across"))]


def _gravity_effects(problem: Problem, values: Values) -> EffectValues:
    """A weight, and the tilt that turns it; several joints without links are no chain of these."""
    if problem.n > 1 and not problem.links.known:
        return {}
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


def _gravity_in_space(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    more = s.links.with_gravity(np.array([p[axis][0] for axis in _AXES]))
    return gravity_torque(more, s.q) / s.ratio, z


def _gravity_in_space_probes(scene: Scene) -> list[Probe]:
    """A little more gravity along each axis of the base."""
    if scene.problem.links.is_planar:
        return []
    more = _SMALL_GRAVITY + 0 * scene.torque
    return [Probe(dict.fromkeys(_AXES, more), _AXES)]


GRAVITY_IN_SPACE = Cause(
    "gravity", (Piece("load", _gravity_in_space),),
    tuple(Number(axis, "m/s^2", scope="robot") for axis in _AXES), _gravity_in_space_probes,
    variant="in_space", needs_links=True, of_effect=lambda *_: {})


def corrected_gravity(links: Links, values: Values) -> np.ndarray:
    """Gravity of a fitted model in the frame of the base (3,) [m/s^2]."""
    def of(cause: Cause, name: str) -> float:
        value = values.get(f"{cause.block}.{name}")
        return 0.0 if value is None else float(value.flat[0])

    more = np.array([of(GRAVITY_IN_SPACE, axis) for axis in _AXES])
    return more + links.has_gravity * _under_a_tilt(
        links.gravity, *(of(BASE_TILT_IN_SPACE, name) for name in ("tilt_x", "tilt_y")))


def tip_mass(s: State) -> BodyTerms:
    """Own mass, shared mass and torque of 1 kg at the tip, motor side."""
    unit = unit_tip_links(s.links)
    own, cross = split_mass(mass_rows(unit, s.q))
    torque = bias_torque(unit, s.q, s.dq)
    return own / s.ratio, cross / s.ratio, torque / s.ratio


def _payload(s: State, p: Values) -> BodyTerms:
    own, cross, torque = tip_mass(s)
    return p["mass"] * own, p["mass"] * cross, p["mass"] * torque


def _payload_probes(scene: Scene) -> list[Probe]:
    reach = scene.problem.links.length.sum()
    mass = np.min(0.03 * scene.inertia * scene.problem.gear_ratio) / reach**2
    return [Probe({"mass": mass + 0 * scene.torque}, ("mass",))]


def _payload_effect(problem: Problem, values: Values) -> EffectValues:
    """A mass at the end of a planar chain; no effect of the catalogue is the same in space."""
    if not problem.links.is_planar:
        return {}
    links = problem.links
    return {"payload": {"mass": values["payload.mass"], "length": links.length,
                        "gear_ratio": problem.gear_ratio,
                        "gravity": np.array([links.g * links.has_gravity])}}


PAYLOAD = Cause("payload", (Piece("body", _payload),),
                (Number("mass", "kg", 0.0, scope="robot"),), _payload_probes, needs_links=True,
                of_effect=_payload_effect)


def _coupling(s: State, p: Values) -> BodyTerms:
    own, cross = split_mass(mass_rows(s.links, s.q))
    torque = coriolis_torque(s.links, s.q, s.dq)
    return (p["share"] * (own - s.links.diagonal) / s.ratio, p["share"] * cross / s.ratio,
            p["share"] * torque / s.ratio)


def _coupling_probes(scene: Scene) -> list[Probe]:
    """Whole coupling of the stated links, where the nominal model leaves it out."""
    if scene.problem.n < 2 or scene.problem.links.has_coupling:
        return []
    return [Probe({"share": 1.0 + 0 * scene.torque})]


COUPLING = Cause("coupling", (Piece("body", _coupling),),
                 (Number("share", "1", scope="robot", fixed=True),), _coupling_probes,
                 needs_links=True, of_effect=lambda problem, values: {})
