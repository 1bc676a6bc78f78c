"""A simulator's log with the robot's: missing signals are filled in, impossible ones refused."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records import Record
from clie_blocks.errors import RecordError

LEAST_MOTION, MOST_MOTION = 0.05, 20.0  # of the robot's range: outside, a unit is wrong
UNITS = {180.0 / np.pi: "degrees instead of rad", 1e3: "thousandths of the stated unit"}
SAME_FACTOR = 0.05  # relative, between the ratio of two motions and the factor of a unit


def with_command(record: Record, law: StatedLaw) -> Record:
    """Simulator's log with its command, computed by the law of the robot where it is missing."""
    if record.u is not None:
        return record
    zero = np.zeros_like(record.q)
    reference = record.q[:1] if record.qd is None else record.qd
    excitation = zero if record.pe is None else record.pe
    return record.replace(u=law.replay(record.q, reference, excitation)).noted(
        "The simulator's log has no command: computed by the stated law.")


def check_motion(simulated: Log, log: Log, joints: Sequence[str]) -> None:
    """Refuse a simulator's log whose joints move as no model of the robot would.

    Parameters
    ----------
    simulated, log : Log
        The same experiment, as simulated and as measured.
    joints : sequence of str
        Names.

    Raises
    ------
    RecordError
        If a joint stands still, or moves far more or less than the robot's; names the unit.

    """
    travel = np.ptp(log.q, axis=0)
    ratio = np.ptp(simulated.q, axis=0) / np.maximum(travel, 1e-12)
    for k, name in enumerate(joints):
        if travel[k] > 0 and not LEAST_MOTION < ratio[k] < MOST_MOTION:
            raise RecordError(
                f"{simulated.name}: {name} moves {ratio[k]:.3g} times as far as the robot's in "
                f"the same experiment{_likely_unit(ratio[k])}. A simulator so far off is no model "
                "of it: check that its log holds positions in rad (m of an axis), in the order of "
                "the robot's joints")


def _likely_unit(ratio: float) -> str:
    """Unit that would explain the ratio of two motions, as a clause; empty where there is none."""
    return next((f"; it looks like {description}" for factor, description in UNITS.items()
                 if abs(ratio / factor - 1.0) < SAME_FACTOR), "")
