"""Robots whose joints hold three to six effects at once, as the joints of real machines do.

What a drive train holds is drawn from published identifications of its kind:

- *industrial* arms with stiff gears: dry friction that depends on speed, load and temperature
  (Bittencourt and Gunnarsson, J. Dyn. Sys., Meas., Control 134 (5), 2012), ripple of motor and
  gear, the lag of the drive;
- *collaborative* arms with strain wave gears: friction with memory, elasticity with hysteresis,
  kinematic error (Tuttle and Seering, IEEE Trans. Robot. Autom. 12 (3), 1996; Madsen et al.,
  Control Eng. Practice 101, 2020);
- *hobby* servos with spur gears: dry friction, backlash, delay, coarse encoders, a dead zone
  (Hwangbo et al., Science Robotics 4 (26), 2019, for the delay);
- *direct* drives and screws: friction that differs between the directions, cogging (Janot,
  Gautier and Brunot, EMPS, 2019; Holtz and Springob, IEEE Trans. Ind. Electron. 43 (2), 1996).

One effect leads, the others are smaller: of the excess of the refitted nominal model the smallest
make about a hundredth.
"""

import numpy as np

from clie_blocks.analysis.blind.engine.robot import ARTICULATED
from clie_blocks.analysis.blind.population import arms_in_space
from clie_blocks.analysis.blind.population.catalogue import CATALOGUE
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.standard import MANY, ONE_OF, draw_trial

TRAINS = {
    "industrial": (("stribeck", "coulomb", "load_dependent_friction"), (
        "friction_drift", "torque_ripple", "gear_mesh_ripple", "actuator_lag", "payload",
        "position_dependent_friction", "joint_elasticity")),
    "collaborative": (("stribeck", "maxwell_slip", "presliding", "coulomb"), (
        "joint_elasticity", "torsional_hysteresis", "kinematic_error", "torque_ripple",
        "friction_drift", "payload", "time_delay")),
    "hobby": (("coulomb", "directional_efficiency", "asymmetric_coulomb"), (
        "backlash", "time_delay", "encoder_quantization", "dead_zone", "actuator_saturation",
        "torque_ripple", "encoder_eccentricity")),
    "direct": (("asymmetric_coulomb", "coulomb", "stribeck"), (
        "torque_ripple", "commutation_ripple", "actuator_lag", "quadratic_drag", "payload",
        "periodic_disturbance", "motor_heating"))}
"""Dry friction of a drive train, of which it has one kind, and what else it may hold."""
COUNTS = (3, 3, 4, 4, 5, 6)  # effects of a robot
SIZES = (("strong", "medium", "medium"), ("strong", "medium", "mild"),
         ("medium", "medium", "mild"), ("strong", "strong", "medium"))
"""Sizes of the first three effects of a robot, see `standard.SEVERITY`; any further is mild."""
IN_SPACE = 4  # of so many robots one is an arm in space
NOT_TOGETHER = (*ONE_OF, ("torsional_hysteresis", "joint_elasticity"),
                ("torque_ripple", "commutation_ripple"),
                ("motor_heating", "actuator_lag"))  # the engine's heated motor has no lag


def plan(seed: int, index: int) -> tuple[tuple[str, ...], tuple[str, ...], bool]:
    """Effects of a trial, the size of each, and whether its robot is an arm in space."""
    rng = np.random.default_rng([seed, 6, index])
    train = list(TRAINS)[index % len(TRAINS)]
    in_space = index // len(TRAINS) % IN_SPACE == IN_SPACE - 1
    names = _names(rng, train, int(rng.choice(COUNTS)), in_space)
    first = SIZES[rng.integers(len(SIZES))]
    sizes = rng.permutation([*first, *("mild",) * (len(names) - len(first))])
    return names, tuple(map(str, sizes)), in_space


def _names(rng: np.random.Generator, train: str, count: int, in_space: bool) -> tuple[str, ...]:
    """Friction of a drive train with what else it holds, none of which exclude each other."""
    frictions, others = TRAINS[train]
    vocabulary = arms_in_space.NAMES if in_space else CATALOGUE
    while True:
        names = (str(rng.choice(frictions)),
                 *map(str, rng.choice(others, count - 1, replace=False)))
        if (set(names) <= set(vocabulary.effects)
                and all(len({*names} & {*group}) < 2 for group in NOT_TOGETHER)):
            return names


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    names, sizes, in_space = plan(seed, index)
    if in_space:
        return draw_trial(rng, index, MANY, names, sizes, ARTICULATED,
                          vocabulary=arms_in_space.NAMES)
    return draw_trial(rng, index, MANY, names, sizes, vocabulary=CATALOGUE)


MANY_CAUSES = Population(_draw, (6,))
