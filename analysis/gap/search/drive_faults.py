"""Faults of a drive that the logged commands place: steps, a clock that beats, lost packets.

The torque that such a fault adds is a function of the logged command and of a few numbers.  Its
product with the error, sent back through the filters of the loop, is what it would explain: one
transform tries every beat, one sum every stretch that a command may have been held.
"""

from collections.abc import Collection, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.drive import PACKET_HOLD, TICK_JITTER, TORQUE_QUANTIZATION
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, Values
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.beating_clock import best_beat, no_beat
from clie_blocks.analysis.gap.search.drive_errors import drive_errors
from clie_blocks.analysis.gap.search.events import Found
from clie_blocks.analysis.gap.search.held_packets import best_hold, no_hold
from clie_blocks.analysis.gap.search.torque_steps import best_step, no_step

_SEARCHES = ((TICK_JITTER, best_beat, no_beat), (PACKET_HOLD, best_hold, no_hold),
             (TORQUE_QUANTIZATION, best_step, no_step))


def drive_fault_candidates(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                           causes: Sequence[Cause], joints: Collection[int]) -> Found:
    """Return clocks that beat, held commands and torques in steps, and what they would explain.

    They are sought at some joints; none are returned where there are no such joints.
    """
    searches = [search for search in _SEARCHES if search[0] in causes] if joints else []
    by_joint = drive_errors(residuals, fit, errors, joints) if searches else {}
    n, logs, found = residuals.problem.n, len(residuals.problem.logs), Found()
    for cause, best, idle in searches:
        uses = [best(by_joint[k]) if k in by_joint else idle(logs) for k in range(n)]
        values = {name: np.stack([np.asarray(use.values[name], float) for use in uses], axis=-1)
                  for name in uses[0].values}
        found.append((Member(cause, tuple(range(n)), values, _sizes(values)),
                      np.array([use.drop for use in uses])))
    return found


def _sizes(values: Values) -> Values:
    sizes = {name: np.abs(value) + 1e-9 for name, value in values.items()}
    small = {"beat": 0.01, "phase": 0.02}  # Hz and turns that have a visible effect
    return {name: small[name] + 0.0 * size if name in small else size
            for name, size in sizes.items()}
