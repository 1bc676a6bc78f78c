"""Effects that no block of the catalogue holds: "unknown" is the right answer."""

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import G
from clie_blocks.analysis.blind.population.effect_site import Change, Draw, Site, proportional
from clie_blocks.analysis.blind.population.outsiders import IN_CATALOGUE, OUTSIDERS

KEPT = tuple(name for name in OUTSIDERS if name not in IN_CATALOGUE)  # of the standard study


def _hose(rng: np.random.Generator, site: Site) -> Change:
    """Hose that creeps: stiff against a quick move, slack after a rest."""
    return proportional(site, "hose", 10 * site.torque, hose_time=rng.uniform(0.3, 2.0))


def _neighbour_spring(rng: np.random.Generator, site: Site) -> Change:
    """Stiffness that follows the joint before, so that its motion pumps this one."""
    return proportional(site, "neighbour", 40 * site.torque)


def _magnetic_detent(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "detent", site.torque, detent_teeth=float(rng.integers(8, 30)))


def _sloshing_payload(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    last = np.zeros(robot.n)
    last[-1] = np.min(site.torque * robot.ratio / (G * robot.length.sum()))
    length = np.full(robot.n, rng.uniform(0.1, 0.3))
    return lambda size: {"slosh": size * last, "slosh_length": length}


def _bending_link(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    last = np.arange(robot.n) == robot.n - 1
    return lambda size: {"link_stiffness": np.where(last, 3 / size * robot.kp * robot.ratio, 0)}


def _soft_mount(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    stiffness = 6 * np.max(robot.kp * robot.ratio)
    return lambda size: {"mount_stiffness": np.full(robot.n, stiffness / size)}


def _lifting_brush(rng: np.random.Generator, site: Site) -> Change:
    return lambda size: site.at("brush", min(0.1 * size, 1.0))


def _running_up(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "imbalance", 0.3 * site.torque, phase=rng.uniform(0, 6.28),
                        imbalance_hz=rng.uniform(0.3, 1.0))


FOREIGN: dict[str, Draw] = {
    **{name: OUTSIDERS[name] for name in KEPT},
    "creeping_hose": _hose, "neighbour_spring": _neighbour_spring,
    "magnetic_detent": _magnetic_detent, "sloshing_payload": _sloshing_payload,
    "bending_link": _bending_link, "soft_mount": _soft_mount, "lifting_brush": _lifting_brush,
    "imbalance_running_up": _running_up,
    "dragging_brake": lambda rng, site: proportional(site, "brake", 2 * site.torque),
    "lost_counts": lambda rng, site: proportional(site, "lost_counts", 5e-4)}
