"""Trials of one joint with one link and one effect, of those that every simulator is given."""

import numpy as np

from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.standard import draw_trial

NAMES = ("coulomb", "spring", "actuator_lag", "asymmetric_coulomb", "time_delay",
         "quadratic_drag", "actuator_saturation", "joint_elasticity", "stribeck", "presliding",
         "torque_ripple", "backlash")
SIZES = "medium", "strong"


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    lap, place = divmod(index, len(NAMES))
    return draw_trial(rng, index, "single", (NAMES[place],), SIZES[(lap + place) % 2], "pendulum")


ONE_JOINT = Population(_draw, (12,))
