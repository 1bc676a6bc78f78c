"""The hidden effects of the standard study: what each changes, as a function of its size.

`EFFECTS` are those that the study calls known, `OUTSIDERS` are not.  Which they are, and their
order, fixes what its seeds draw; `catalogue` holds all other names.  An effect is drawn once
and then scaled: at size 1 the motion changes by some tenths of a milliradian to a few
milliradians.
"""

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import G
from clie_blocks.analysis.blind.population.effect_site import (
    Change,
    Draw,
    Site,
    proportional,
    with_unit,
)
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.population.vocabulary import Needs, Vocabulary


def _coulomb(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "level", site.torque)


def _stribeck(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "level", site.torque, static=rng.uniform(1.5, 2.2),
                        stribeck=rng.uniform(0.01, 0.05))


def _asymmetric(rng: np.random.Generator, site: Site) -> Change:
    share = rng.choice([-1, 1]) * rng.uniform(0.4, 0.9)
    return lambda size: (site.at("level", size * site.torque)
                         | site.at("bias", share * size * site.torque))


def _quadratic(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "quadratic", site.torque / 0.1)


def _load_dependent(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "slope", 0.01)


def _presliding(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "bristle", site.torque,
                        bristle_range=np.exp(rng.uniform(np.log(2e-3), np.log(2e-2))))


def _drift(rng: np.random.Generator, site: Site) -> Change:
    key = str(rng.choice(["warm_drag", "warm_level"]))
    unit = site.torque / 0.3 if key == "warm_drag" else site.torque
    return proportional(site, key, unit, warm_time=rng.uniform(4.0, 12.0))


def _gravity(rng: np.random.Generator, site: Site) -> Change:
    return lambda size: {"tilt": np.full(site.robot.n, 2e-3 * size)}


def _payload(rng: np.random.Generator, site: Site) -> Change:
    robot, unit = site.robot, 0.0
    if robot.gravity:
        unit = np.min(site.torque * robot.ratio / (G * robot.length.sum()))
    else:
        unit = np.min(0.01 * robot.kp * robot.ratio / 36.0 / robot.length.sum() ** 2)
    last = np.zeros(robot.n)
    last[-1] = unit
    return lambda size: {"payload": size * last}


def _coupling(rng: np.random.Generator, site: Site) -> Change:
    """Links that are coupled: a share of those drawn, which grows with the size."""
    return lambda size: {"links": np.full(site.robot.n, min(0.1 * size, 1.5))}


def _spring(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    return proportional(site, "stiffness", 3e-3 * robot.kp * robot.ratio,
                        rest=robot.pose + rng.uniform(-0.3, 0.3, robot.n))


def _elasticity(rng: np.random.Generator, site: Site) -> Change:
    robot = site.robot
    ratio = rng.uniform(0.03, 0.08)

    def change(size: float) -> dict[str, np.ndarray]:
        stiffness = 150.0 / size * robot.kp * robot.ratio
        return (site.at("twist_stiffness", stiffness)
                | site.at("twist_damping", 2 * ratio * np.sqrt(stiffness * robot.link)))
    return change


def _backlash(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "half_gap", 5e-4)


def _saturation(rng: np.random.Generator, site: Site) -> Change:
    return lambda size: site.at("limit", site.largest_command / (1 + 0.15 * size))


def _delay(rng: np.random.Generator, site: Site) -> Change:
    """A delayed drive, or a delayed encoder."""
    return proportional(site, str(rng.choice(["delay", "delay", "late"])), 1e-3)


def _ripple(rng: np.random.Generator, site: Site) -> Change:
    """A harmonic of the motor's turn, high enough to show within the travel."""
    poles = rng.integers(1, 4) + np.floor(8.0 / site.robot.ratio[site.joint])
    return proportional(site, "ripple", site.torque, phase=rng.uniform(0, 6.28), poles=poles)


def _tone(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "tone", site.torque, phase=rng.uniform(0, 6.28),
                        tone_hz=np.exp(rng.uniform(np.log(0.3), np.log(4.0))))


def _fault(rng: np.random.Generator, site: Site) -> Change:
    kinds = ("fault_torque", 1.0), ("fault_level", 1.0), ("fault_drag", 3.0)
    key, unit = kinds[rng.integers(3)]
    return proportional(site, key, unit * site.torque, fault_share=rng.uniform(0.3, 0.7))


EFFECTS: dict[str, Draw] = {
    "coulomb": _coulomb, "stribeck": _stribeck, "asymmetric_coulomb": _asymmetric,
    "quadratic_drag": _quadratic, "load_dependent_friction": _load_dependent,
    "presliding": _presliding, "friction_drift": _drift,
    "gravity": _gravity, "payload": _payload, "coupling": _coupling, "spring": _spring,
    "joint_elasticity": _elasticity, "backlash": _backlash,
    "actuator_saturation": _saturation,
    "dead_zone": lambda rng, site: proportional(site, "dead", site.torque),
    "actuator_lag": with_unit("lag", 1e-3), "time_delay": _delay,
    "torque_ripple": _ripple,
    "torque_gain_error": lambda rng, site: lambda size: site.at("gain", 1 + 0.02 * size),
    "encoder_quantization": with_unit("step", 3e-4),
    "encoder_eccentricity": lambda rng, site: proportional(
        site, "eccentric", 2e-4, phase=rng.uniform(0, 6.28)),
    "velocity_filter_mismatch":
        lambda rng, site: lambda size: site.at("corner", 1 / (1 + 0.1 * size)),
    "periodic_disturbance": _tone, "step_fault": _fault}

WHOLE_ROBOT = ("gravity", "payload", "coupling", "wall")
NEEDS: dict[str, Needs] = {
    "gravity": (("arm", "pendulum"), False, True), "payload": (("arm", "pendulum"), None, True),
    "coupling": (("arm",), False, False), "wall": (("arm", "pendulum"), None, True),
    "load_dependent_friction": (("arm", "pendulum"), True, True)}

STANDARD_NAMES = Vocabulary(EFFECTS, OUTSIDERS, WHOLE_ROBOT, NEEDS)
