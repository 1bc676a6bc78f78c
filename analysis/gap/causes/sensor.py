"""Where to look for causes in the measured position."""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    BodyTerms,
    Cause,
    EffectValues,
    Number,
    Probe,
    Scene,
    Values,
    cause_of,
)
from clie_blocks.analysis.gap.causes.description import changed_links
from clie_blocks.analysis.gap.causes.drive import LONGEST_DELAY, counts_motor_turns
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.delay import DelayLine, constant_delay
from clie_blocks.rigid_body.scalars import times, total
from clie_blocks.robot_loop.dynamics import Piece, State
from clie_blocks.robot_loop.links import gravity_torque

_WORST = 0.02  # rad: a degree of eccentricity
_HARMONICS = range(1, 7)  # waves per turn of the motor, of a gear that runs unevenly
_PUSHES_BACK = 30.0  # gear ratio below which a link that runs ahead and behind shakes its motor


def _probes(scene: Scene) -> list[Probe]:
    shaft = scene.problem.shaft_ratio
    size = 1e-4 + 0 * shaft
    orders = {tuple(order) for order in (1 + 0 * shaft, 2 + 0 * shaft, shaft, 2 * shaft)}
    return [Probe({"sine": size, "cosine": size, "order": np.array(order)}, ("sine", "cosine"))
            for order in sorted(orders)]


def _gear_probes(scene: Scene) -> list[Probe]:
    """Once and twice per turn of the motor, as harmonic drives err, and their harmonics."""
    problem, size = scene.problem, 1e-4 + 0 * scene.torque
    geared = any(counts_motor_turns(ratio) for ratio in problem.gear_ratio)
    return [Probe({"sine": size, "cosine": size, "order": turns * problem.gear_ratio},
                  ("sine", "cosine")) for turns in _HARMONICS] if geared else []


def _unfelt_probes(scene: Scene) -> list[Probe]:
    return [] if scene.problem.two_encoders else _gear_probes(scene)


def _felt_probes(scene: Scene) -> list[Probe]:
    """Where an encoder of the motor sees the link push back, or a small gear lets it."""
    if not (scene.problem.two_encoders or (scene.problem.gear_ratio < _PUSHES_BACK).any()):
        return []
    links, ratio = scene.problem.links, scene.problem.gear_ratio
    link = links.diagonal / ratio if links.known else 0.4 * scene.inertia
    return [Probe({**probe.values, "link_inertia": link}, probe.amplitudes)
            for probe in _gear_probes(scene)]


def _push_of_link(s: State, p: Values) -> BodyTerms:
    """What a motor feels of a link that it turns by the slope of its gear, beyond a slope of 1."""
    sine, cosine = np.sin(p["order"] * s.q), np.cos(p["order"] * s.q)
    wave = p["sine"] * sine + p["cosine"] * cosine
    slope = 1.0 + p["order"] * (p["sine"] * cosine - p["cosine"] * sine)
    bend = -p["order"] ** 2 * wave
    own = p["link_inertia"] * (slope**2 - 1.0)
    bearing = s.links.bearing_damping / s.ratio
    torque = p["link_inertia"] * slope * bend * s.dq**2 + bearing * (slope**2 - 1.0) * s.dq
    if s.links.has_gravity:
        at_link, at_motor = (gravity_torque(s.links, q) / s.ratio for q in (s.q + wave, s.q))
        torque = torque + slope * at_link - at_motor
    return own, np.zeros((s.links.n, s.links.n)), torque


def _pull_of_belt(s: State, p: Values) -> BodyTerms:
    """What motors feel of links that move along with the joint before, beyond their own motion."""
    n, coupling = s.links.n, s.links.motor_coupling
    dragged = [[1.0 if i == k else p["ratio"][k] if i + 1 == k else 0.0 for i in range(n)]
               for k in range(n)]
    if coupling is not None:
        dragged = [[total(*(times(c, row[i]) for c, row in zip(of_joint, dragged)))
                    for i in range(n)] for of_joint in coupling]
    links = dataclasses.replace(s.links, motor_coupling=tuple(map(tuple, dragged)))
    own, cross, torque = changed_links(s, links, s.q)
    bearing = [each.at_motors(each.bearing_damping * each.at_joints(s.dq)[0])
               for each in (links, s.links)]
    return own, cross, torque + (bearing[0] - bearing[1]) / s.ratio


def _belt_probes(scene: Scene) -> list[Probe]:
    return [Probe({"ratio": 1e-3 + 0 * scene.torque}, ("ratio",))] * (scene.problem.n > 1)


def _as_effect(name: str, numbers: tuple[str, ...],
               ) -> Callable[[Problem, Values], EffectValues]:
    """The effect of a variant that is felt; the effect leaves out what the motor feels."""
    def of_effect(problem: Problem, values: Values) -> EffectValues:
        return {name: {number: np.asarray(values[f"{name}_felt.{number}"]) for number in numbers}}
    return of_effect


KINEMATIC_ERROR = cause_of(
    LIBRARY["kinematic_error"], ("sine", "cosine", "order"), _unfelt_probes, fixed=("order",),
    within={"sine": (-_WORST, _WORST), "cosine": (-_WORST, _WORST)})
KINEMATIC_ERROR_FELT = Cause(
    "kinematic_error", (*KINEMATIC_ERROR.pieces, Piece("body", _push_of_link)),
    (*KINEMATIC_ERROR.numbers, Number("link_inertia", "kg m^2", 0.0, 1e4, neutral=None,
                                      nuisance=True)),
    _felt_probes, variant="felt",
    of_effect=_as_effect("kinematic_error", ("sine", "cosine", "order")))
ENCODER_ECCENTRICITY = cause_of(
    LIBRARY["encoder_eccentricity"], ("sine", "cosine", "order"), _probes, fixed=("order",),
    within={"sine": (-_WORST, _WORST), "cosine": (-_WORST, _WORST)})
COUPLED_JOINTS = cause_of(
    LIBRARY["coupled_joints"], ("ratio",),
    lambda scene: [] if scene.problem.links.known else _belt_probes(scene),
    within={"ratio": (-1.5, 1.5)})
COUPLED_JOINTS_FELT = Cause(
    "coupled_joints", (*COUPLED_JOINTS.pieces, Piece("body", _pull_of_belt)),
    COUPLED_JOINTS.numbers, _belt_probes, variant="felt", needs_links=True,
    of_effect=_as_effect("coupled_joints", ("ratio",)))


def _encoder_delays(scene: Scene) -> list[Probe]:
    """Delays where one joint pushes another; elsewhere those of the drive say it all."""
    if scene.problem.n == 1 or not scene.problem.links.has_coupling:
        return []
    return [Probe({"delay": delay + 0 * scene.torque}) for delay in (1.5e-3, 5e-3, 0.016)]


# A delayed encoder acts as a delayed drive until one joint pushes another: the push comes in time.
ENCODER_DELAY = cause_of(
    dataclasses.replace(LIBRARY["time_delay"], port="sensor",
                        sampled=DelayLine(("q",), constant_delay, longest="delay")),
    ("delay",), _encoder_delays, within={"delay": (0.0, LONGEST_DELAY)}, variant="encoder",
    needs_links=True)
