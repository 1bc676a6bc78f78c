"""Laws that damp a velocity which the drive measured, rather than formed from the positions.

    u = Kp (q_d - q) - Kd dq + pe = Kp (q_d - q) - Kd F(z) q + (pe - Kd r),   r = dq - F(z) q

A model has no such sensor.  It forms its velocity by the filter F(z) that comes nearest to the
logged one, which gives its feedback the lag of the drive's; what no filter explains, r, was logged
and is a known excitation.  So the law gives the logged commands exactly.

A law of the user's own may do more with a velocity than damp it: there r is added to the velocity
that a model forms, see `drive_signals`.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.initial_state import LEAST_INITIAL_SPEED
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks.law import explained_rms
from clie_blocks.analysis.records.control_law import gains, stated_variant
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.replay import replay, sample_time
from clie_blocks.analysis.records.velocity_filter import settling, velocity_filter
from clie_blocks.errors import ClieError
from clie_blocks.linear_filters import lfilter
from clie_blocks.robot_loop.sampled_law import VELOCITY, read_of_drive

EXACT = "exact"
CORNERS = 24  # of filters that are tried, evenly apart on a logarithmic scale
SLOWEST = 2 * np.pi  # rad/s, of them
ROWS = 20000  # of the first log, by which they are compared
# Parts beside which a law does not simply add -Kd dq to the rest of its command.
NOT_BESIDE = ("error_filter", "command_filter", "command_rate", "dead_band", "punch")
PASSED_ON = (None, "gravity", "inverse_dynamics")  # compensations beside which it does


def with_measured_velocity(robot: Robot, records: Sequence[Record],
                           ) -> tuple[Robot, list[Record]]:
    """Robot and records whose law forms its velocity, where it damps a logged one.

    That is so where the robot file says it, ``velocity_filter = "exact"``, and where the commands
    are those of the law on the logged velocity and not on the stated one.
    """
    controller, records = robot.controller, list(records)
    if VELOCITY in read_of_drive(controller.block):
        formed = _nearest_filter(records[0], controller)
        note = (f"The law reads the velocity dq that was logged; models form theirs by the filter "
                f"that comes nearest to it, {_describe(formed)}, and get the rest as it was.")
        return (dataclasses.replace(robot, controller=formed),
                [record.noted(note) for record in records])
    if not _is_additive(controller) or not all(_has_all(log, controller) for log in records):
        return robot, records
    stated = stated_variant(controller)
    if stated != EXACT and not _ran_on_logged_velocity(records, robot):
        return robot, records
    formed = _nearest_filter(records[0], controller)
    said = "as stated" if stated == EXACT else "though that is not stated"
    note = (f"The law damps the velocity dq that was logged, {said}; models form theirs by the "
            f"filter that comes nearest to it, {_describe(formed)}, and the rest is excitation.")
    return (dataclasses.replace(robot, controller=formed),
            [_with_rest(record, formed).noted(note) for record in records])


def _is_additive(controller: Controller) -> bool:
    """Whether a law of the file adds its damping to the rest of its command."""
    return (controller.law in ("pd", "pid", "cascade") and controller.kp is not None
            and controller.compensation in PASSED_ON and controller.reference_rate != "filtered"
            and all(getattr(controller, key) is None for key in NOT_BESIDE))


def _has_all(record: Record, controller: Controller) -> bool:
    """Whether a log holds what its law read, at the rate of the law."""
    period = controller.sample_time or record.sample_time
    return (record.dq is not None and record.u is not None and record.qd is not None
            and bool(np.isfinite(record.dq[record.valid]).all())
            and period == sample_time(record, controller))


def _ran_on_logged_velocity(records: Sequence[Record], robot: Robot) -> bool:
    """Whether the law gives the commands to rounding by the logged velocity, and else does not."""
    return not robot.controller.is_block and all(
        _leaves_rounding(record, robot, EXACT) and not _leaves_rounding(record, robot, None)
        for record in records)


def _leaves_rounding(record: Record, robot: Robot, variant: str | None) -> bool:
    """Whether the law leaves no more than rounding, with one velocity or any but the logged."""
    if variant is None:
        record = record.replace(dq=None)
    try:
        result = replay(record, robot.controller, variant)
    except ClieError:
        return False
    return bool(np.all(result.rms <= explained_rms(record, robot, result)))


def _nearest_filter(record: Record, controller: Controller) -> Controller:
    """Controller whose velocity filter comes nearest to the logged velocity of a record."""
    period = sample_time(record, controller)
    plain = dataclasses.replace(controller, velocity_filter="difference", highpass=None,
                                lowpass=None, discretisation=None)
    fastest = 1e3 / period  # its pole forgets within a sample: one lag remains
    lags = np.geomspace(SLOWEST, 1.0 / period, CORNERS)
    candidates = [plain, dataclasses.replace(plain, velocity_filter="two_tap"), *(
        dataclasses.replace(plain, velocity_filter="two_corner", highpass=float(corner),
                            lowpass=fastest, discretisation="backward") for corner in lags)]
    part = record.part(0, min(len(record), ROWS))
    return min(candidates, key=lambda one: float(np.mean(
        np.nanstd(_rest(part, one), axis=0) / (np.nanstd(part.signal("dq"), axis=0) + 1e-300))))


def _rest(record: Record, controller: Controller) -> np.ndarray:
    """What of the logged velocity a filter does not give, shape (N, n) [rad/s].

    The filter begins at rest, or where the robot moves as if it had come on a ramp.
    """
    period, dq = sample_time(record, controller), record.signal("dq")
    fastest = np.nanmax(np.abs(dq), axis=0)
    slope = np.where(np.abs(dq[0]) > LEAST_INITIAL_SPEED * fastest, dq[0], 0.0)
    return velocity_beyond(filter_of(controller, period), record.q, dq, slope, period)


def filter_of(controller: Controller, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of the filter by which models form a velocity that the law reads."""
    return velocity_filter(stated_variant(controller) or "difference", period, controller.corners)


def velocity_beyond(velocity: tuple[np.ndarray, np.ndarray], q: np.ndarray, dq: np.ndarray,
                    slope: np.ndarray, period: float) -> np.ndarray:
    """What of a measured velocity a filter does not give of the positions, shape (N, n) [rad/s].

    Before the first sample the joints moved along a slope (n,) [rad/s].
    """
    b, a = velocity
    forgotten = settling(a)
    behind = period * np.arange(-forgotten, 0)
    moved = np.concatenate([np.outer(behind, slope), q - q[0]])
    return dq - lfilter(b, a, moved - moved[0])[forgotten:]


def _with_rest(record: Record, controller: Controller) -> Record:
    """Record with what the law made of the rest of its velocity as excitation."""
    rest = np.nan_to_num(_rest(record, controller))
    added = -gains(controller)[1] * rest
    if controller.law == "cascade" and controller.ki is not None:
        added = added - controller.ki * sample_time(record, controller) * np.cumsum(rest, axis=0)
    return record.replace(pe=added if record.pe is None else record.pe + added)


def _describe(controller: Controller) -> str:
    if controller.highpass is not None:
        return f"a difference of samples behind a lag of {1e3 / controller.highpass:.3g} ms"
    return f"velocity_filter = \"{controller.velocity_filter}\""
