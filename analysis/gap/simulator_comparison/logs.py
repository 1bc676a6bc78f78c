"""A simulator's log beside the robot's: what it lacks is filled in, what cannot be is refused."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records import Record
from clie_blocks.errors import RecordError

LEAST_MOTION, MOST_MOTION = 0.05, 20.0  # of the robot's range: a wrong unit, no model
UNITS = {180.0 / np.pi: "degrees in the place of rad", 1e3: "thousandths of the stated unit"}
NEAR = 0.05  # of a unit's factor


def with_command(record: Record, law: StatedLaw) -> Record:
    """Simulator's log with its command, worked out by the law of the robot where it lacks.

    Parameters
    ----------
    record : Record
        The simulator's log, with reference and excitation.
    law : ControlLaw
        The law that ran on the robot.

    """
    if record.u is not None:
        return record
    zero = np.zeros_like(record.q)
    asked = (record.q[:1] if record.qd is None else record.qd,
             zero if record.pe is None else record.pe)
    return record.replace(u=law.replay(record.q, *asked)).noted(
        "The simulator's log has no command: worked out by the stated law.")


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
    ratio = np.ptp(simulated.q, axis=0) / np.maximum(np.ptp(log.q, axis=0), 1e-12)
    for k in np.flatnonzero((np.ptp(log.q, axis=0) > 0)
                            & ~((ratio > LEAST_MOTION) & (ratio < MOST_MOTION))):
        unit = next((f"; it looks like {words}" for factor, words in UNITS.items()
                     if abs(ratio[k] / factor - 1.0) < NEAR), "")
        raise RecordError(
            f"{simulated.name}: {joints[k]} moves {ratio[k]:.3g} times as far as the robot's in "
            f"the same experiment{unit}. A simulator so far off is no model of it: check that its "
            "log holds positions in rad (m of an axis), in the order of the robot's joints")
