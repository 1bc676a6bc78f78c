"""The marks by which effects are known that would otherwise swallow any other.

A fault that may set in at any moment, a weight of any size, friction that drifts, stops anywhere
in the range: each can absorb a part of whatever acts.  It earns its name by what nothing else
would show.  A fault and a limit act at some times only: before these the model must be right
without them, since no effect acts before its cause.
"""

import numpy as np

from clie_blocks.analysis.gap.causes.drive import (
    ACTUATOR_SATURATION,
    COMMUTATION_RIPPLE,
    GEAR_MESH_RIPPLE,
    PACKET_HOLD,
    TORQUE_RIPPLE,
    counts_motor_turns,
)
from clie_blocks.analysis.gap.causes.friction import FRICTION_DRIFT
from clie_blocks.analysis.gap.causes.load import (
    GRAVITY,
    GRAVITY_IN_SPACE,
    SOFT_STOP,
    corrected_gravity,
)
from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

_REST_ROWS = 200  # into which a log is cut to see whether a joint rests
WAVES = (TORQUE_RIPPLE, COMMUTATION_RIPPLE, GEAR_MESH_RIPPLE)


def causes_without_marks(fit: Fit, residuals: ResidualModel) -> tuple[str, ...]:
    """Names of the causes of a fitted hypothesis whose marks the logs do not show."""
    return tuple(member.cause.name for member in fit.hypothesis.members
                 if not _shows_mark(fit.hypothesis, member, residuals))


def _shows_mark(hypothesis: Hypothesis, member: Member, residuals: ResidualModel) -> bool:
    method = residuals.method.verdict
    if member.cause in STEP_FAULT:
        return (_sets_in_at_once(hypothesis, member, method)
                and _is_right_before(hypothesis, member, residuals))
    if member.cause is ACTUATOR_SATURATION:
        return _is_right_before(hypothesis, member, residuals)
    if member.cause in (GRAVITY, GRAVITY_IN_SPACE):
        return _is_weight_of_links(hypothesis, member, method)
    if member.cause in FRICTION_DRIFT:
        return _drifts_within_logs(hypothesis, member, method)
    if member.cause is PERIODIC_DISTURBANCE:
        return _repeats_within_logs(hypothesis, member, method)
    if member.cause in WAVES:
        return (_turns_with_the_motor(hypothesis, member, method)
                or _is_seen_in_motion(hypothesis, member, residuals))
    if member.cause is SOFT_STOP:
        return _is_at_the_ends(hypothesis, member, method)
    if member.cause is PACKET_HOLD:
        return _leaves_nearly_nothing(hypothesis, member, residuals)
    return True


def _turns_with_the_motor(hypothesis: Hypothesis, waves: Member, method: VerdictMethod) -> bool:
    """Whether waves come a whole number of times per motor turn, over many turns.

    Nothing outside the motor does that but by accident.
    """
    problem, joints = hypothesis.problem, list(waves.joints)
    sine, cosine, order = (hypothesis.values[f"{waves.name}.{name}"][joints]
                           for name in ("sine", "cosine", "order"))
    ratio = problem.gear_ratio[joints]
    turns = ratio / (2 * np.pi) * np.ptp(np.concatenate([log.q for log in problem.fit]),
                                         axis=0)[joints]
    per_turn = order / ratio
    is_whole = ((np.round(per_turn) >= 1.0) & (turns >= method.least_turns)
                & (np.abs(per_turn - np.round(per_turn)) * turns < method.off_whole_waves)
                & np.array([counts_motor_turns(each) for each in ratio]))
    return bool(np.all(is_whole | ~acting(np.hypot(sine, cosine), method)))


def _is_seen_in_motion(hypothesis: Hypothesis, waves: Member, residuals: ResidualModel) -> bool:
    """Whether waves over the pose explain the motion, and not the rests between motions alone.

    Where a joint rests, short waves are a torque of their own for each pose, whatever it is.  Logs
    without long rests decide, if there are any: waves that rests have suggested explain little of
    them.
    """
    method, logs = residuals.method.verdict, range(len(hypothesis.problem.logs))
    in_motion = [j for j in logs if not any(
        _rests(hypothesis.problem.logs[j].q[:, k], method) for k in waves.joints)]
    if len(in_motion) == len(logs):
        return True
    without = hypothesis.with_values(_neutral(hypothesis, waves))
    gained = np.zeros(2)  # while the joint rests, and while it moves
    beyond_noise = 0.0
    for j in in_motion or logs:
        left = residuals.whitened(hypothesis.error(j), j)
        all_of_it = residuals.whitened(without.error(j), j)
        for k in waves.joints:
            moving = _moving(hypothesis.problem.logs[j].q[:, k], len(left[k]), method)
            gain = all_of_it[k] ** 2 - left[k] ** 2
            gained += gain[~moving].sum(), gain[moving].sum()
            beyond_noise += float(np.sum(all_of_it[k] ** 2 - 1.0))
    if in_motion:
        return bool(gained.sum() >= method.seen_in_motion * beyond_noise)
    return bool(gained[1] >= method.seen_in_motion * gained.sum())


def _rests(q: np.ndarray, method: VerdictMethod) -> bool:
    """Whether a joint rests for long in a log."""
    rows = min(len(q) - 1, _REST_ROWS)
    return bool(rows > 0 and np.mean(_moving(q, rows, method)) < 1.0 - method.long_rests)


def _moving(q: np.ndarray, rows: int, method: VerdictMethod) -> np.ndarray:
    """Which of the last rows of a log, of equal length, a joint moves in, shape (rows,)."""
    edges = np.linspace(0, len(q) - 1, rows + 1).astype(int)
    travel = np.abs(np.diff(q[edges]))
    return travel > method.resting * travel.max(initial=0.0)


def acting(sizes: np.ndarray, method: VerdictMethod) -> np.ndarray:
    """Which joints have a fair share of the largest size among them."""
    return np.abs(sizes) >= method.acting_share * np.abs(sizes).max()


def _sets_in_at_once(hypothesis: Hypothesis, fault: Member, method: VerdictMethod) -> bool:
    """Whether a fault sets in away from the ends of a log, and at all of its joints together."""
    problem, joints = hypothesis.problem, np.array(fault.joints)
    key = f"{fault.name}.{fault.cause.numbers[0].name}"
    sizes = np.broadcast_to(hypothesis.values[key], problem.n)[joints]
    typical = np.broadcast_to(fault.sizes[fault.cause.numbers[0].name], problem.n)[joints]
    onsets = hypothesis.values[f"{fault.name}.onset"][:, joints[acting(sizes / typical, method)]]
    for log, of_log in zip(problem.law_logs, onsets):
        duration = len(log) * problem.period
        seen = of_log[of_log < duration]
        if seen.size and (np.ptp(seen) > method.same_moment or seen.min() < method.away_from_ends
                          or seen.max() > duration - method.away_from_ends):
            return False
    return True


def _is_right_before(hypothesis: Hypothesis, member: Member, residuals: ResidualModel) -> bool:
    """Whether the model errs less before a cause acts than what the cause explains afterwards.

    What was wrong all the time is something else.  Where the logs begin with the cause at work
    there is nothing to compare.
    """
    before = gained = 0.0
    rows_before = rows_after = 0
    without = hypothesis.with_values(_neutral(hypothesis, member))
    for j, log in enumerate(hypothesis.problem.logs):
        left = residuals.whitened(hypothesis.error(j), j)
        all_of_it = residuals.whitened(without.error(j), j)
        ticks = residuals.rows(j).ticks * hypothesis.problem.period
        for k in member.joints:
            times = ticks * np.arange(1, len(left[k]) + 1)
            times += len(log) * hypothesis.problem.period - times[-1]
            idle = times < _first_moment(hypothesis, member, j, k)
            before += float(np.sum(left[k][idle] ** 2 - 1.0))
            gained += float(np.sum(all_of_it[k][~idle] ** 2 - left[k][~idle] ** 2))
            rows_before, rows_after = rows_before + idle.sum(), rows_after + (~idle).sum()
    if rows_before < residuals.method.verdict.least_rows_before or not rows_after:
        return True
    share = residuals.method.verdict.right_before
    return before / rows_before <= share * gained / rows_after


def _leaves_nearly_nothing(hypothesis: Hypothesis, holds: Member, residuals: ResidualModel,
                           ) -> bool:
    """Whether held packets leave next to nothing of what they explain, at the joints they act on.

    Kicks of another origin, such as contacts that come again and again, they match in part.
    """
    method, problem = residuals.method, hypothesis.problem
    without = hypothesis.with_values(_neutral(hypothesis, holds))
    gained, left, rows = np.zeros((3, problem.n))
    for j in range(len(problem.fit)):
        with_holds = residuals.whitened(hypothesis.error(j), j)
        all_of_it = residuals.whitened(without.error(j), j)
        for k in holds.joints:
            left[k] += np.sum(with_holds[k] ** 2 - 1.0)
            gained[k] += np.sum(all_of_it[k] ** 2 - with_holds[k] ** 2)
            rows[k] += len(with_holds[k])
    most = np.maximum(method.verdict.held_packets_leave * gained,
                      method.calibration.healthy * rows)
    return bool(np.all(left <= most, where=acting(gained, method.verdict)))


def _neutral(hypothesis: Hypothesis, member: Member) -> dict[str, np.ndarray]:
    """Values without a cause."""
    keys = {f"{member.name}.{number.name}": number.neutral for number in member.cause.numbers
            if number.neutral is not None}
    return {name: np.full_like(value, keys[name]) if name in keys else value
            for name, value in hypothesis.values.items()}


def _first_moment(hypothesis: Hypothesis, member: Member, j: int, k: int) -> float:
    """Time at which a cause first acts on joint k in log j [s]."""
    if member.cause in STEP_FAULT:
        run = hypothesis.problem.runs[j]
        return float(hypothesis.values[f"{member.name}.onset"][run, k])
    u = hypothesis.problem.logs[j].u[:, k]
    beyond = np.flatnonzero(np.abs(u) > hypothesis.values[f"{member.name}.limit"][k])
    return beyond[0] * hypothesis.problem.period if beyond.size else np.inf


def _is_weight_of_links(hypothesis: Hypothesis, gravity: Member, method: VerdictMethod) -> bool:
    """Whether a weight is one that the stated links may have, however their base is tilted.

    More than their whole weight, no tilt brings about.  Of several joints without stated links
    nothing tells how their weights follow the pose.
    """
    problem, links = hypothesis.problem, hypothesis.problem.links
    if not links.known:
        return problem.n == 1
    if gravity.cause is GRAVITY_IN_SPACE:
        whole = np.linalg.norm(corrected_gravity(links, hypothesis.values))
        return bool(whole <= method.most_weight * links.g)
    along, across = (hypothesis.values[f"{gravity.name}.{name}"][0]
                     for name in ("along", "across"))
    return bool(np.hypot(along + links.has_gravity, across) <= method.most_weight)


def _drifts_within_logs(hypothesis: Hypothesis, drift: Member, method: VerdictMethod) -> bool:
    """Whether friction still drifts once the robot moves, rather than at the start of the log."""
    times = hypothesis.values[f"{drift.name}.time_constant"][list(drift.joints)]
    left = np.exp(-method.away_from_ends / times)
    return bool(np.all(left >= method.drift_left))


def _repeats_within_logs(hypothesis: Hypothesis, disturbance: Member,
                         method: VerdictMethod) -> bool:
    """Whether a disturbance repeats often enough in a log to be told from a bend of the motion."""
    problem = hypothesis.problem
    longest = max(len(log) for log in problem.logs) * problem.period
    frequency = np.max(hypothesis.values[f"{disturbance.name}.frequency"])
    return bool(frequency * longest >= method.least_periods)


def _is_at_the_ends(hypothesis: Hypothesis, stop: Member, method: VerdictMethod) -> bool:
    """Whether joints are free of their stops most of the time: else these are springs."""
    joints = np.array(stop.joints)
    stiffness, lower, upper = (hypothesis.values[f"{stop.name}.{name}"][joints]
                               for name in ("stiffness", "lower", "upper"))
    course = np.concatenate([log.q for log in hypothesis.problem.fit])[:, joints]
    at_stop = ((course < lower) | (course > upper)).mean(axis=0)
    pushing = stiffness * np.ptp(course, axis=0)
    return bool(np.all(at_stop[acting(pushing, method)] <= method.most_at_stop))
