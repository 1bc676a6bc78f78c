"""Causes that depend on the pose or on the mass that is moved."""

import numpy as np

from clie_blocks.analysis.gap import links
from clie_blocks.analysis.gap.causes.cause import Cause, Number, Probe
from clie_blocks.analysis.gap.simulated import Piece


def _spring(s, z, p):
    return p["stiffness"] * s.q, z


SPRING = Cause(
    "spring", lambda problem: (Piece("load", _spring),), (Number("stiffness", "N m/rad"),),
    lambda scene: [Probe({"stiffness": scene.small_torque() / scene.travel}, ("stiffness",))],
    frees=("load",))


def _gravity_pieces(problem):
    chain, ratio = problem.chain, problem.gear_ratio

    def weight(s, z, p):
        if chain.known:
            even = links.gravity_torque(chain, s.q) / ratio
            turned = links.gravity_torque(chain, s.q, np.pi / 2) / ratio
        else:
            even, turned = np.cos(s.q), -np.sin(s.q)
        return p["along"] * even + p["across"] * turned, z

    return (Piece("load", weight),)


def _gravity_probes(scene):
    chain, ratio = scene.problem.chain, scene.problem.gear_ratio
    if not chain.known:
        size = scene.small_torque()
        return [Probe({"along": size, "across": size}, ("along", "across"))]
    stretched = links.gravity_torque(chain, np.zeros((1, chain.n)))[0] / ratio
    share = np.min(0.03 * scene.torque / np.maximum(stretched, 1e-12)) + 0 * scene.torque
    return [Probe({"along": share, "across": share}, ("along", "across"))]


GRAVITY = Cause(
    "gravity", _gravity_pieces, (Number("along", "1", scope="robot"),
                                 Number("across", "1", scope="robot")), _gravity_probes)


def tip_mass(problem):
    """Own mass, shared mass and torque of 1 kg at the tip, motor side."""
    unit, ratio = links.unit_tip_chain(problem.chain), problem.gear_ratio

    def act(s):
        if problem.n == 1:
            own, cross = unit.length**2 + 0.0 * s.q, 0.0 * s.q
        else:
            m_11, m_12, m_22 = links.mass_entries(unit, s.q[1])
            own, cross = np.array([m_11, m_22 + 0.0 * m_11]), m_12
        torque = links.coriolis_torque(unit, s.q, s.dq)
        if problem.chain.has_gravity:
            torque = torque + links.gravity_torque(unit, s.q)
        return own / ratio, cross / ratio, torque / ratio

    return act


def _payload_pieces(problem):
    unit = tip_mass(problem)

    def act(s, p):
        own, cross, torque = unit(s)
        return p["mass"] * own, p["mass"] * cross, p["mass"] * torque

    return (Piece("body", act),) if problem.chain.known else ()


def _payload_probes(scene):
    if not scene.problem.chain.known:
        return []
    reach = scene.problem.chain.length.sum()
    mass = np.min(0.03 * scene.inertia * scene.problem.gear_ratio) / reach**2
    return [Probe({"mass": mass + 0 * scene.torque}, ("mass",))]


PAYLOAD = Cause("payload", _payload_pieces, (Number("mass", "kg", 0.0, scope="robot"),),
                _payload_probes)


def _coupling_pieces(problem):
    chain, ratio = problem.chain, problem.gear_ratio

    def act(s, p):
        m_11, m_12, m_22 = links.mass_entries(chain, s.q[1])
        own = (np.array([m_11, m_22 + 0.0 * m_11]) - chain.diagonal) / ratio
        torque = links.coriolis_torque(chain, s.q, s.dq) / ratio
        return p["share"] * own, p["share"] * m_12 / ratio, p["share"] * torque

    return (Piece("body", act),)


def _coupling_probes(scene):
    chain = scene.problem.chain
    if scene.problem.n != 2 or not chain.known:
        return []
    return [Probe({"share": 0.1 + 0 * scene.torque}, ("share",))]


COUPLING = Cause("coupling", _coupling_pieces, (Number("share", "1", scope="robot"),),
                 _coupling_probes)
