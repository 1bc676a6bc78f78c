"""The study of the whole catalogue: every name in turn, with robots that have none.

The trials of one lap hold every effect, every parameter and every outsider once; from lap to lap
an effect meets another size.
"""

from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS, WHOLE_ROBOT
from clie_blocks.analysis.blind.population.electronic import ELECTRONIC
from clie_blocks.analysis.blind.population.foreign import FOREIGN
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.mechanical import MECHANICAL
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.population.standard import draw_trial, size_in_turn
from clie_blocks.analysis.blind.population.vocabulary import Vocabulary

KNOWN_OUTSIDERS = ("soft_stop", "motor_heating", "hidden_integral")  # made as in that study
HEALTHY = 12  # robots without an effect in one lap
_CARRYING = (("arm", "pendulum"), True, True)
_CHAIN, _LEVEL_CHAIN = (("arm",), None, True), (("arm", "pendulum"), False, True)

CATALOGUE = Vocabulary(
    effects={**EFFECTS, **MECHANICAL, **ELECTRONIC,
             **{name: OUTSIDERS[name] for name in KNOWN_OUTSIDERS}},
    outsiders=FOREIGN,
    whole_robot=(*WHOLE_ROBOT, "base_tilt", "fluid_drag", "supply_sag", "sloshing_payload",
                 "bending_link", "soft_mount"),
    needs={**NEEDS, "base_tilt": _CARRYING, "encoder_offset": _CARRYING, "fluid_drag": _CHAIN,
           "coupled_joints": _CHAIN, "wall": _CHAIN, "neighbour_spring": _CHAIN,
           "magnetic_detent": _CHAIN, "sloshing_payload": _CARRYING,
           "bending_link": _LEVEL_CHAIN, "soft_mount": _LEVEL_CHAIN},
    first_joint=dict.fromkeys(("coupled_joints", "neighbour_spring", "magnetic_detent"), 1),
    motor_encoders=1 / 3, two_encoders=1 / 3,
    joint_encoders=("kinematic_error", "ratio_error", "coupled_joints"))

Truth = dict[str, np.ndarray]
Parameter = tuple[str, Callable[[np.random.Generator, DrawnRobot], tuple[float, float]]]
# Key of a parameter of the datasheet; factor and term that put it beyond its tolerance.
PARAMETERS: dict[str, Parameter] = {
    "inertia": ("rotor", lambda rng, robot: (1 + rng.uniform(0.04, 0.15), 0.0)),
    "viscous": ("drag", lambda rng, robot: (1 + rng.uniform(0.4, 0.9), 0.0)),
    "torque_gain": ("gain", lambda rng, robot: (
        1 + rng.choice([-1, 1]) * rng.uniform(0.05, 0.15), 0.0)),
    "offset": ("offset", lambda rng, robot: (1.0, rng.choice([-1, 1]) * rng.uniform(0.03, 0.1)))}
LAP = len(CATALOGUE.effects) + len(PARAMETERS) + len(FOREIGN) + HEALTHY  # trials


def plan(seed: int, index: int) -> tuple[str, str | None, str | None]:
    """Kind, name and severity of a trial; the names of a lap come in an order of their own."""
    order = [*(("single", name) for name in CATALOGUE.effects),
             *(("parametric", name) for name in PARAMETERS),
             *(("unknown", name) for name in FOREIGN), *[("none", None)] * HEALTHY]
    lap, position = divmod(index, LAP)
    which = int(np.random.default_rng([seed, 3, LAP]).permutation(LAP)[position])
    kind, name = order[which]
    if kind in ("single", "unknown"):
        return kind, name, size_in_turn(which + lap + seed, least=int(kind == "unknown"))
    return kind, name, None


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    kind, name, severity = plan(seed, index)
    names = (name,) if name is not None and kind != "parametric" else ()
    wrong = beyond_tolerance(name) if name is not None and kind == "parametric" else None
    trial = draw_trial(rng, index, kind, names, severity, vocabulary=CATALOGUE, wrong=wrong)
    if wrong is not None:
        trial.label["labels"] = [name]
    return trial


def beyond_tolerance(name: str) -> Callable[[np.random.Generator, DrawnRobot, Truth], Truth]:
    """Change of one parameter at one joint beyond the datasheet's tolerance."""
    key, draw = PARAMETERS[name]

    def change(rng: np.random.Generator, robot: DrawnRobot, truth: Truth) -> Truth:
        k, values = int(rng.integers(robot.n)), truth[key].copy()
        factor, term = draw(rng, robot)
        values[k] = factor * values[k] + term * robot.kp[k]
        return {**truth, key: values}
    return change


WHOLE_CATALOGUE = Population(_draw, (3,))
