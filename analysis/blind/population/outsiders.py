"""Effects outside the vocabulary of the diagnosis: "unknown" is the right answer."""

import numpy as np

from clie_blocks.analysis.blind.engine.world import tip_path
from clie_blocks.analysis.blind.population.effect_site import (
    Change,
    Draw,
    Site,
    proportional,
    with_unit,
)


def _hard_stop(rng: np.random.Generator, site: Site) -> Change:
    """End of the travel a little before the farthest angle."""
    return lambda size: site.at("hard_stop", site.farthest - 1e-3 * size)


def _wall(rng: np.random.Generator, site: Site) -> Change:
    """Wall that the tip meets a little before the end of its path."""
    robot = site.robot
    at, along = tip_path(robot)
    angles = [np.cumsum(q, axis=1) for q, _ in site.runs]
    paths = [(np.cos(a) @ robot.length - at[0]) * along[0]
             + (np.sin(a) @ robot.length - at[1]) * along[1] for a in angles]
    farthest = max(path.max() for path in paths)
    return lambda size: {"wall": np.full(
        robot.n, max(farthest - 1e-3 * size * robot.length.sum(), 1e-6))}


OUTSIDERS: dict[str, Draw] = {
    "random_torque": lambda rng, site: proportional(site, "random", site.torque),
    "packet_loss": with_unit("lost", 0.01),
    "position_friction": lambda rng, site: proportional(
        site, "wavy_level", 2 * site.torque, waves=rng.uniform(6, 12),
        phase=rng.uniform(0, 6.28)),
    "wavy_damping": lambda rng, site: proportional(
        site, "wavy_drag", 5 * site.torque, waves=rng.uniform(4, 8),
        phase=rng.uniform(0, 6.28)),
    "wandering_stiffness": lambda rng, site: proportional(
        site, "wandering", 10 * site.torque, rest=site.robot.pose),
    "soft_stop": lambda rng, site: proportional(
        site, "stop_stiffness", 20 * site.torque,
        stop=site.robot.pose + rng.uniform(0.05, 0.12)),
    "hard_stop": _hard_stop, "wall": _wall,
    "motor_heating": lambda rng, site: proportional(
        site, "heating", 0.02 / site.power, heating_time=rng.uniform(3.0, 10.0)),
    "supply_sag": with_unit("sag", 0.02),
    "hidden_integral": lambda rng, site: proportional(site, "integral", 0.02 * site.robot.kp),
    "gain_scaling": lambda rng, site: lambda size: site.at("kp_factor", 1 + 0.01 * size)}

IN_CATALOGUE: dict[str, str] = {
    "packet_loss": "packet_hold", "position_friction": "position_dependent_friction",
    "soft_stop": "soft_stop", "hard_stop": "soft_stop", "motor_heating": "motor_heating",
    "supply_sag": "supply_sag", "hidden_integral": "hidden_integral",
    "gain_scaling": "gain_error"}
"""Those that a diagnosis knows by now, and their names in the catalogue."""


def known_as(name: str, robot: str) -> str | None:
    """Name in the catalogue of an outsider at a robot such as "arm of 2"; None if it has none.

    A wall in the way of a single link is the end of its travel.
    """
    if name == "wall" and robot.endswith(" of 1"):
        return "soft_stop"
    return IN_CATALOGUE.get(name)
