"""Where to look for the frictions of the catalogue."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Probe, Scene, cause_of, waves_over_travel
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.load_dependent_friction import load_dependent_limits

_BRISTLE_TIME = 0.1  # s: damping over stiffness at which columns are simulated

COULOMB = cause_of(
    LIBRARY["coulomb"], ("level",),
    lambda scene: [Probe({"level": scene.small_torque()}, ("level",))])


def _stribeck_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "excess": size, "velocity": speed * np.ones_like(size)},
                  ("level", "excess")) for speed in (0.01, 0.02, 0.04, 0.08, 0.16)]


STRIBECK = cause_of(LIBRARY["stribeck"], ("level", "excess", "velocity"), _stribeck_probes,
                    within={"velocity": (2e-3, 1.0)}, without=("coulomb", "excess"))

ASYMMETRIC_COULOMB = cause_of(
    LIBRARY["asymmetric_coulomb"], ("forward", "backward"),
    lambda scene: [Probe({"forward": scene.small_torque(), "backward": scene.small_torque()},
                         ("forward", "backward"))],
    even=("coulomb", "forward", "backward"))

QUADRATIC_DRAG = cause_of(
    LIBRARY["quadratic_drag"], ("drag",),
    lambda scene: [Probe({"drag": scene.small_torque() / scene.speed**2}, ("drag",))])

def _fluid_probes(scene: Scene) -> list[Probe]:
    """Nothing for a single joint, whose drag is quadratic."""
    joint_side = scene.problem.gear_ratio / scene.speed**2
    return [] if scene.problem.n == 1 else [
        Probe({"drag": scene.small_torque() * joint_side}, ("drag",))]


FLUID_DRAG = cause_of(LIBRARY["fluid_drag"], ("drag",), _fluid_probes,
                      at_first_joint="quadratic_drag")


def _load_probes(scene: Scene) -> list[Probe]:
    return [Probe({"level": scene.small_torque(), "share": 0.03 + 0 * scene.torque},
                  ("level", "share"))]


OF_LINKS = dataclasses.replace(  # the load that the gear carries, in the place of the motor's
    LIBRARY["load_dependent_friction"],
    build=dry_friction(load_dependent_limits, inputs=("dq", "carried")))
LOAD_DEPENDENT_FRICTION = (
    cause_of(LIBRARY["load_dependent_friction"], ("level", "share"), _load_probes,
             without=("coulomb", "share")),
    cause_of(OF_LINKS, ("level", "share"), _load_probes, without=("coulomb", "share"),
             variant="links", needs_links=True))


_REACH = 1e-4, 0.5  # rad: below, no log tells it from dry friction
_REACHES = 0.001, 0.003, 0.008, 0.02, 0.05, 0.12  # rad
_STIFF_BRISTLES = "coulomb", "reach"


def _presliding_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "reach": reach + 0 * size,
                   "bristle_damping": _BRISTLE_TIME * size / reach}, ("level", "bristle_damping"))
            for reach in _REACHES]


PRESLIDING = cause_of(LIBRARY["presliding"], ("level", "bristle_damping", "reach"),
                      _presliding_probes, held={"static_ratio": 1.0, "velocity": 10.0},
                      within={"reach": _REACH}, without=_STIFF_BRISTLES)


def _bending_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "reach": reach + 0 * size}, ("level",)) for reach in _REACHES]


def _dahl_probes(scene: Scene) -> list[Probe]:
    return [Probe({**probe.values, "exponent": 1.0 + 0 * scene.torque}, probe.amplitudes)
            for probe in _bending_probes(scene)]


DAHL = cause_of(LIBRARY["dahl"], ("level", "reach", "exponent"), _dahl_probes,
                within={"reach": _REACH}, without=_STIFF_BRISTLES)
MAXWELL_SLIP = cause_of(LIBRARY["maxwell_slip"], ("level", "reach"), _bending_probes,
                        within={"reach": _REACH}, without=_STIFF_BRISTLES)


def _position_probes(scene: Scene) -> list[Probe]:
    size = scene.small_torque()
    return [Probe({"level": size, "sine": size, "cosine": size, "order": order},
                  ("level", "sine", "cosine"), {"order": 1.0 / scene.travel})
            for order in waves_over_travel(scene)]


POSITION_DEPENDENT_FRICTION = cause_of(
    LIBRARY["position_dependent_friction"], ("level", "sine", "cosine", "order"),
    _position_probes, phase=("order",), within={"order": (2.0, 1e4)},
    without=("coulomb", "sine", "cosine"))


def _rest_probes(scene: Scene) -> list[Probe]:
    """Small excesses, which act in proportion, and large ones that hold the joint for a while.

    Of the large ones it counts how fast they grow: their time is longer than most rests.
    """
    size = scene.small_torque()

    def shape(time: float, speed: float) -> dict[str, np.ndarray]:
        return {"half_time": time + 0 * size, "velocity": speed + 0 * size,
                "slip": 0.02 + 0 * size}

    small = [Probe({"rise": size, **shape(time, speed)}, ("rise",))
             for time in (0.3, 2.0) for speed in (0.01, 0.04)]
    large = [Probe({"rise": share * scene.torque, **shape(3.0, 0.01)})
             for share in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)]
    return small + large


REST_TIME_BREAKAWAY = cause_of(
    LIBRARY["rest_time_breakaway"], ("rise", "half_time", "velocity", "slip"), _rest_probes,
    within={"velocity": (2e-3, 1.0), "half_time": (0.01, 100.0), "slip": (1e-3, 0.5)})

DIRECTIONAL_EFFICIENCY = cause_of(
    LIBRARY["directional_efficiency"], ("driving", "backdriving"),
    lambda scene: [Probe({"driving": 0.03 + 0 * scene.torque,
                          "backdriving": 0.03 + 0 * scene.torque}, ("driving", "backdriving"))])


def _times(scene: Scene) -> list[tuple[float, np.ndarray]]:
    """Time constants, with the clock started anew in each log or running through all logs."""
    logs = scene.problem.law_logs
    running = np.cumsum([0.0] + [len(log) * scene.problem.period for log in logs[:-1]])
    shape = (len(logs), scene.problem.n)
    anew = np.zeros(shape)
    through = np.broadcast_to(running[:, None], shape)
    return [(t, since) for t in (4.0, 12.0, 40.0) for since in (anew, through)]


def _drift_probes(scene: Scene, sizes: dict[str, np.ndarray]) -> list[Probe]:
    return [Probe({**sizes, "time_constant": t + 0 * scene.torque, "since": since}, tuple(sizes))
            for t, since in _times(scene)]


_WARM_UP = {"time_constant": (1.0, 300.0)}
FRICTION_DRIFT = (
    cause_of(LIBRARY["friction_drift"], ("viscous_change", "time_constant", "since"),
             lambda scene: _drift_probes(
                 scene, {"viscous_change": scene.small_torque() / scene.speed}),
             fixed=("since",), per_log=("since",), within=_WARM_UP, variant="viscous"),
    cause_of(LIBRARY["friction_drift"], ("level", "coulomb_change", "time_constant", "since"),
             lambda scene: _drift_probes(scene, {"level": scene.small_torque(),
                                                 "coulomb_change": scene.small_torque()}),
             fixed=("since",), per_log=("since",), within=_WARM_UP, variant="dry",
             without=("coulomb", "coulomb_change")),
)
