"""What a robot file states wrong: a gain, a number of the motor or the links, the joint order.

Every function changes an `Export` in place and returns what it chose, for the label.
"""

import tomllib

import numpy as np

from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError, Export
from clie_blocks.analysis.blind.imperfect.log_damages import Change, Choice

PER_JOINT = ("motor", "links", "controller", "encoder")
NEAR_THE_MIDDLE = 0.15  # of the link: measured from either end, com is nearly the same


def misstate(section: str, key: str, factor: float) -> Change:
    """Return the change of a number at one joint, by a factor up or down."""
    def change(export: Export, rng: np.random.Generator) -> Choice:
        values = export.stated(section, key)
        k, wrong = int(rng.integers(values.size)), float(rng.choice([factor, 1 / factor]))
        values[k] *= wrong
        export.state(section, key, values)
        return {"joint": k + 1, "factor": wrong}
    return change


def com_from_far_end(export: Export, rng: np.random.Generator) -> Choice:
    """Centre of mass of one link, measured from its far end."""
    length, com = export.stated("links", "length_m"), export.stated("links", "com_m")
    off = np.flatnonzero(np.abs(length - 2 * com) > NEAR_THE_MIDDLE * length)
    if not off.size:
        raise DoesNotApplyError("the centres of mass lie near the middle of their links")
    k = int(rng.choice(off))
    com[k] = length[k] - com[k]
    export.state("links", "com_m", com)
    return {"joint": k + 1}


def other_joint_order(export: Export, rng: np.random.Generator) -> Choice:
    """Joints listed in the reverse order of the log."""
    table = tomllib.loads(export.robot)
    lists = [(section, key) for section in PER_JOINT
             for key, value in table.get(section, {}).items()
             if isinstance(value, list) and len(value) == export.joints]
    turned = [(section, key, export.stated(section, key)[::-1]) for section, key in lists]
    if all(np.array_equal(values, values[::-1]) for *_, values in turned):
        raise DoesNotApplyError("all joints are alike")
    for section, key, values in turned:
        export.state(section, key, values)
    return {}
