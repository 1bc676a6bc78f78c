"""Effects of friction, load and transmission that the standard study does not name.

As in `effects`: drawn once, then scaled; at size 1 the motion changes by some tenths of a
milliradian to a few milliradians.
"""

import numpy as np

from clie_blocks.analysis.blind.engine.robot import LINKS_UNSTATED
from clie_blocks.analysis.blind.population.effect_site import Change, Draw, Site, proportional


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _dahl(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "dahl", site.torque, dahl_reach=between(rng, 2e-3, 2e-2),
                        dahl_exponent=rng.uniform(0.5, 2.5))


def _maxwell_slip(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "slip", site.torque, slip_reach=between(rng, 3e-3, 3e-2))


def _position_dependent_friction(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "uneven_level", site.torque, uneven=rng.uniform(0.4, 0.9),
                        waves=rng.uniform(6, 20), phase=rng.uniform(0, 6.28))


def _rest_time_breakaway(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "rest_rise", 4 * site.torque, rest_half=between(rng, 0.2, 3.0),
                        rest_speed=between(rng, 5e-3, 3e-2), rest_slide=between(rng, 5e-3, 5e-2))


def _directional_efficiency(rng: np.random.Generator, site: Site) -> Change:
    ratio = rng.uniform(1.5, 5.0)
    return lambda size: (site.at("driving_loss", 0.005 * size)
                         | site.at("driven_loss", ratio * 0.005 * size))


def _base_tilt(rng: np.random.Generator, site: Site) -> Change:
    sign = rng.choice([-1, 1])
    return lambda size: {"base_tilt": np.full(site.robot.n, 2e-3 * sign * size)}


def _counterbalance(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    return proportional(site, "balance", 5 * site.torque * robot.ratio,
                        balance_angle=robot.pose + rng.choice([-1, 1]) * rng.uniform(0.5, 2.5),
                        balance_slack=rng.uniform(0.2, 0.6))


def _fluid_drag(rng: np.random.Generator, site: Site) -> Change:
    """One fluid around all links."""
    robot = site.robot
    reach = np.cumsum(robot.length[::-1])[::-1]
    unit = np.min(40 * site.torque * robot.ratio / reach**4)
    return lambda size: {"fluid": np.full(robot.n, unit * size)}


def _soft_gear(site: Site, size: float) -> np.ndarray:
    """Stiffness of a gear, the lower the larger its effect [N m/rad, joint side]."""
    return 150.0 / size * site.robot.kp * site.robot.ratio


def _carried(site: Site) -> np.ndarray:
    """Torque that the gear carries at most, without the rotor's part [N m, joint side]."""
    robot = site.robot
    whole = robot.rotor * robot.ratio**2  # where links are not stated, the rotors include them
    if robot.kind not in LINKS_UNSTATED:
        whole = whole + robot.link
    return site.largest_command * robot.ratio * robot.link / whole


def _damping(site: Site, stiffness: np.ndarray, ratio: float) -> np.ndarray:
    return 2 * ratio * np.sqrt(stiffness * site.robot.link)


def _stiffening_elasticity(rng: np.random.Generator, site: Site) -> Change:
    """Spring that is twice as stiff beyond a share of the torque that the gear carries."""
    ratio, share = rng.uniform(0.03, 0.08), rng.uniform(0.2, 0.6)

    def change(size: float) -> dict[str, np.ndarray]:
        stiffness = _soft_gear(site, size)
        return (site.at("twist_stiffness", stiffness)
                | site.at("twist_damping", _damping(site, stiffness, ratio))
                | site.at("twist_knee", share * _carried(site) / stiffness))
    return change


def _torsional_hysteresis(rng: np.random.Generator, site: Site) -> Change:
    """Spring with a part that slips beside it: the loop of torque over twist encloses losses."""
    share, beside = rng.uniform(0.1, 0.3), rng.uniform(1.0, 3.0)

    def change(size: float) -> dict[str, np.ndarray]:
        stiffness = _soft_gear(site, size)
        return (site.at("twist_stiffness", stiffness)
                | site.at("twist_damping", _damping(site, stiffness, 0.03))
                | site.at("twist_slip", share * _carried(site))
                | site.at("twist_slip_stiffness", beside * stiffness))
    return change


def _kinematic_error(rng: np.random.Generator, site: Site) -> Change:
    """Once or twice per turn of the motor, and often enough to show within the travel."""
    ratio = site.robot.ratio[site.joint]
    order = ratio * (rng.integers(1, 3) + np.floor(8.0 / ratio))
    phase = rng.uniform(0, 6.28)
    return lambda size: (site.at("wobble", min(0.01 * size, 0.9) / order)
                         | site.at("wobble_order", order) | site.at("phase", phase))


def _gear_mesh_ripple(rng: np.random.Generator, site: Site) -> Change:
    depth = rng.uniform(0.5, 2.0)
    teeth, phase = float(rng.integers(20, 120)), rng.uniform(0, 6.28)
    return lambda size: (site.at("mesh", 0.3 * size * site.torque)
                         | site.at("mesh_depth", min(0.02 * depth * size, 1.0))
                         | site.at("teeth", teeth) | site.at("phase", phase))


def _coupled_joints(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "travel_of_neighbour", 5e-3 * float(rng.choice([-1, 1])))


def _ratio_error(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "ratio_error", 0.01 * float(rng.choice([-1, 1])))


MECHANICAL: dict[str, Draw] = {
    "dahl": _dahl, "maxwell_slip": _maxwell_slip,
    "position_dependent_friction": _position_dependent_friction,
    "rest_time_breakaway": _rest_time_breakaway,
    "directional_efficiency": _directional_efficiency,
    "base_tilt": _base_tilt, "counterbalance": _counterbalance, "fluid_drag": _fluid_drag,
    "stiffening_elasticity": _stiffening_elasticity,
    "torsional_hysteresis": _torsional_hysteresis, "kinematic_error": _kinematic_error,
    "gear_mesh_ripple": _gear_mesh_ripple, "coupled_joints": _coupled_joints,
    "ratio_error": _ratio_error}
