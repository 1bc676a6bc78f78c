"""The faults of the study: what each makes of a run, by the name under which it is to be found."""

from collections.abc import Callable, Mapping

import numpy as np

from clie_blocks.analysis.blind.simulator_faults.joint import PERIOD, Joint
from clie_blocks.analysis.blind.simulator_faults.run import Run

NONE = "none"
DELAY = 2  # periods, of the drive where a fault puts it to another place
Injected = Callable[[np.random.Generator, Joint], Run]


def _changed(**changes: Callable[[Joint], float]) -> Injected:
    """Run in which the engine has other numbers of the joint."""
    return lambda rng, joint: Run(changed={key: value(joint) for key, value in changes.items()})


def _weightless(rng: np.random.Generator, joint: Joint) -> Run:
    return Run(gravity=0.0) if rng.integers(2) else Run(gravcomp=1.0)


INJECTED: Mapping[str, Injected] = {
    NONE: lambda rng, joint: Run(),
    "soft_friction": lambda rng, joint: Run(soft=True),
    "gain_per_degree": lambda rng, joint: Run(gains=np.pi / 180.0),
    "gains_twice": lambda rng, joint: Run(gains=2.0),
    "gravity_twice": lambda rng, joint: Run(gravity=2.0),
    "gravity_missing": _weightless,
    "delay_at_sensor": lambda rng, joint: Run(changed={"delay": 0}, sensor_delay=DELAY),
    "long_step": lambda rng, joint: Run(step=PERIOD / int(rng.integers(1, 3))),
    "armature_without_effect": _changed(armature=lambda joint: 0.0),
    "damping_without_effect": _changed(damping=lambda joint: 0.0),
    "friction_without_effect": _changed(friction=lambda joint: 0.0),
    "damping_for_friction": _changed(friction=lambda joint: 0.0,
                                     damping=lambda joint: joint.damping + joint.friction),
    "gear_twice": _changed(gear=lambda joint: joint.gear**2),
    "gear_missing": _changed(gear=lambda joint: 1.0),
    "limit_behind_gear": lambda rng, joint: Run(joint_limit=True),
    "slow_tick": lambda rng, joint: Run(ticks=int(rng.integers(2, 6))),
    "mass_of_geoms": lambda rng, joint: Run(from_geom=True),
}
"""Name of a fault -> the run that has it, of a joint, with what is left to chance."""
DELAYED = ("delay_at_sensor",)  # their model files delay the drive
