"""Checks of the stated control law against the log: it is replayed, then regressed."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks.command import samples_at_limit
from clie_blocks.analysis.records.checks.coupled_law import check_coupled_law
from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.measures import correlation_matrix, moves, permutation
from clie_blocks.analysis.records.control_law import gains, stated_variant
from clie_blocks.analysis.records.controller_section import COMMANDED, Controller
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import (
    Replay,
    is_in_step,
    replay,
    sample_time,
    settled_samples,
    variants,
    velocity,
)
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.uncertainty import least_squares
from clie_blocks.analysis.records.velocity_filter import settling, velocity_filter

DEGREE = 180 / np.pi
EXPLAINED = 0.3  # share of the residual that another law may leave to be the better one
LOOSE = 0.1  # share of the command beyond which a fitted law does not show its gains
GROSS = 0.25  # error of a gain that no velocity filter can cause
EXACT = 0.01  # error of a gain that counts where the fitted law explains the command
PART = 100_000  # samples of a long log on which a law is replayed at once
SHIFTS = (-3, -2, -1, 1, 2, 3)


@dataclasses.dataclass(frozen=True, eq=False)
class LawFit:
    """Control law of one joint as the log has it: value and 95 % half width by gain."""

    gains: dict[str, tuple[float, float]]
    rms: float
    variant: str


def check_law(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on gains, signs, order, timing and filter of the stated control law."""
    if robot is None or not can_replay(record, robot):
        return []
    return next(filter(None, (_check_part(part, robot) for part in law_parts(record))), [])


def law_parts(record: Record) -> list[Record]:
    """A record in parts that a law is replayed on one after the other, to save memory."""
    if len(record) < 2 * PART:
        return [record]
    edges = np.linspace(0, len(record), len(record) // PART + 1).astype(int).tolist()
    return [record.part(start, stop) for start, stop in itertools.pairwise(edges)]


def _check_part(record: Record, robot: Robot) -> list[Finding]:
    stated = stated_variant(robot.controller)
    result = replay_unsaturated(record, robot, stated)
    unexplained = result.rms > explained_rms(record, robot, result)
    if not unexplained.any():
        return []
    best = replay_unsaturated(record, robot)
    if (best.rms <= explained_rms(record, robot, best)).all():
        return [_variant(best, stated)]
    limit = explained_rms(record, robot, result)
    return (check_coupled_law(record, robot, result, unexplained, limit)
            or _swapped(record, result) or _shifted(record, result, unexplained)
            or [_joint(record, robot, result, k) for k in range(record.n) if unexplained[k]])


def can_replay(record: Record, robot: Robot | None) -> bool:
    """Whether law, reference and the command itself are there."""
    return (robot is not None and robot.controller.law != "unknown" and record.u is not None
            and robot.controller.u_is in (None, COMMANDED)
            and record.qd is not None and len(record) > 10)


def replay_unsaturated(record: Record, robot: Robot, variant: str | None = None) -> Replay:
    """Replay of the law whose RMS leaves out samples with the command at its limit.

    A variant that is not known for this log counts as not stated.
    """
    known = variant in variants(record, robot.controller)
    result = replay(record, robot.controller, variant if known else None)
    apart = np.stack([result.used & ~samples_at_limit(record, None, k)[0]
                      for k in range(record.n)], 1)
    if not apart.any(axis=0).all():
        return result
    rms = np.sqrt(np.mean(result.residual**2, axis=0, where=apart))
    return dataclasses.replace(result, rms=rms)


def explained_rms(record: Record, robot: Robot, result: Replay) -> np.ndarray:
    """RMS of the residual that rounding of command or position explains, per joint."""
    step = robot.encoder.resolution
    through_law = 0.0 if step is None else step * result.law.position_gain()
    return rounding_limit(record.signal("u")[result.used], result.law.resolution, through_law)


def fit_law(record: Record, controller: Controller, k: int) -> LawFit | None:
    """Regress the command of joint k on reference, position, velocity and excitation.

    Of all variants of the velocity the one that leaves least counts; None when nothing moves.
    """
    fits = [fit_variant(record, controller, k, variant)
            for variant in variants(record, controller)]
    return min((fit for fit in fits if fit), key=lambda fit: fit.rms, default=None)


def fit_variant(record: Record, controller: Controller, k: int, variant: str) -> LawFit | None:
    """Regress the command of joint k with the velocity formed in one way, see `variants`."""
    u = record.signal("u")[:, k]
    columns = {"qd": record.signal("qd")[:, k], "q": -record.q[:, k]}
    if variant != "none":
        columns["dq"] = -velocity(record, controller, variant, k)[:, 0]
    if record.pe is not None:
        columns["pe"] = record.pe[:, k]
    _, denominator = velocity_filter(variant, sample_time(record, controller), controller.corners)
    used = settled_samples(record, controller, settling(denominator)) & np.isfinite(u)
    for column in columns.values():
        used &= np.isfinite(column)
    used &= ~samples_at_limit(record, None, k)[0]
    columns = {name: x[used] for name, x in columns.items() if moves(x[used])}
    if np.count_nonzero(used) < 100 or "q" not in columns:
        return None
    matrix = np.stack([x - x.mean() for x in columns.values()], axis=1)
    target = u[used] - u[used].mean()
    if np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0)) > 1e6:
        return None
    fit = least_squares(matrix, target)
    fitted = dict(zip(columns, zip(fit.value, fit.interval, strict=True), strict=True))
    return LawFit(fitted, float(np.sqrt(np.mean(fit.residual**2))), variant)


def _variant(best: Replay, stated: str | None) -> Finding:
    contrast = f"not by '{stated}' as stated" if stated else "which was not stated"
    return Finding("warning", "law.variant", f"The controller forms its velocity by "
                   f"'{best.variant}', {contrast}: with it the command is reproduced.",
                   "Another filter has another delay, which looks like inertia.",
                   f"State it: velocity_filter_discretisation or velocity_filter = "
                   f"\"{best.variant}\".")


def _swapped(record: Record, result: Replay) -> list[Finding]:
    """Commands that follow the law of another joint."""
    used = result.used
    logged, law = (x[used] - x[used].mean(axis=0) for x in (record.signal("u"), result.u))
    order = permutation(correlation_matrix(logged, law))
    if order is None:
        return []
    pairs = ", ".join(f"u of {record.joints[i]} is the command of {record.joints[j]}"
                      for i, j in enumerate(order) if i != j)
    return [Finding("error", "law.swapped", f"Commands are swapped: {pairs}.",
                    "Every joint would be given the torque of another.",
                    f"Reorder the columns of u: permutation {[j + 1 for j in order]}.")]


def _shifted(record: Record, result: Replay, unexplained: np.ndarray) -> list[Finding]:
    """A command that fits the law of a sample before or after."""
    rms = {shift: _shifted_rms(record, result, shift) for shift in SHIFTS}
    best = min(rms, key=lambda shift: np.sum(np.log(rms[shift][unexplained] + 1e-300)))
    if not np.all(rms[best][unexplained] < EXPLAINED * result.rms[unexplained]):
        return []
    side = "late" if best > 0 else "early"
    return [Finding("error", "law.shifted", f"The command is logged {abs(best)} sample"
                    f"{'s' if abs(best) > 1 else ''} {side} against the position: shifted back, "
                    f"the residual of the law falls from {result.rms.max():.3g} to "
                    f"{rms[best].max():.3g}.", "The shift looks like a delay of the robot.",
                    f"Shift u by {-best} samples, as for logs that write the command in the row "
                    "of the state that follows it.")]


def _shifted_rms(record: Record, result: Replay, shift: int) -> np.ndarray:
    moved = np.roll(record.signal("u"), -shift, axis=0)
    used = result.used.copy()
    used[:abs(shift)] = used[-abs(shift):] = False
    return np.sqrt(np.mean((moved[used] - result.u[used]) ** 2, axis=0))


def _joint(record: Record, robot: Robot, result: Replay, k: int) -> Finding:
    fit = fit_law(record, robot.controller, k)
    if fit is None or fit.rms > EXPLAINED * result.rms[k]:
        return _not_understood(record, robot, result, k)
    exact = fit.rms < max(explained_rms(record, robot, result)[k], 1e-300)
    size = np.sqrt(np.mean(record.signal("u")[result.used, k] ** 2))
    if not exact and fit.rms > LOOSE * size:
        return _not_understood(record, robot, result, k)
    tolerance = EXACT if exact else GROSS
    return (_sign(record, k, fit) or _gain(record, robot, k, fit, tolerance)
            or _excitation(record, k, fit, tolerance) or _not_understood(record, robot, result, k))


def _sign(record: Record, k: int, fit: LawFit) -> Finding | None:
    fitted = {name: value for name, (value, _) in fit.gains.items()}
    wrong = [name for name in ("qd", "q") if fitted.get(name, 1) < 0]
    if not wrong:
        return None
    which = {("qd", "q"): "u", ("q",): "u" if "qd" not in fitted else "q", ("qd",): "qd"}
    signal = which[tuple(wrong)]
    return Finding("error", "law.sign", f"By the log the gain on {' and '.join(wrong)} is "
                   "negative: a sign is wrong.", "Such a loop would diverge, and the log does "
                   "not.",
                   f"Invert {signal}: sign = -1 for {signal}_{record.joints[k]}.",
                   joint=record.joints[k])


def stated_gains(controller: Controller, k: int) -> dict[str, tuple[float, str]]:
    """Stated gains of one joint by the signal on which they act, with their names."""
    position, rate = gains(controller)
    cascade = controller.law == "cascade"
    stated = {"q": (position[k], "Kp Kv" if cascade else "Kp")}
    if cascade or controller.kd is not None:
        stated["dq"] = (rate[k], "Kv" if cascade else "Kd")
    return stated


def _gain(record: Record, robot: Robot, k: int, fit: LawFit, tolerance: float) -> Finding | None:
    wrong = []
    for signal, (stated, name) in stated_gains(robot.controller, k).items():
        value, interval = fit.gains.get(signal, (stated, 0.0))
        if abs(value - stated) > max(interval, tolerance * abs(stated)):
            wrong.append((name, value, interval, stated))
    if not wrong:
        return None
    differences = ", ".join(f"{name} = {value:.4g} +- {interval:.2g}, stated is {stated:.4g}"
                            for name, value, interval, stated in wrong)
    ratios = [value / stated if stated else np.inf for _, value, _, stated in wrong]
    check, hint = shared_ratio(robot, k, ratios)
    return Finding("error", check, f"The log shows {differences}.", "With wrong gains the model's "
                   f"loop is not the robot's, and every estimate is wrong. {hint}".strip(),
                   "Correct [controller] in robot.toml.", joint=record.joints[k])


def shared_ratio(robot: Robot, k: int, ratios: Sequence[float]) -> tuple[str, str]:
    """Check and hint that a common ratio of all wrong gains points at."""
    gear = robot.motor.gear_ratio
    for factor, check, hint in (
            (-1.0, "law.sign", "The factor is -1: a sign is wrong."),
            (DEGREE, "law.per_degree", "The factor is 57.3: the stated gains are per degree."),
            (1 / DEGREE, "law.per_degree", "The factor is 1/57.3: q is in degrees, or the stated "
             "gains are meant per degree."),
            *(((gear[k] ** power), "law.side", f"The factor is the gear ratio to the power "
               f"{power}: one is on the motor side, the other on the joint side.")
              for power in (1, -1, 2, -2) if gear is not None and gear[k] > 1.5)):
        if all(abs(ratio / factor - 1) < 0.05 for ratio in ratios):
            return check, hint
    return "law.gain", ""


def _excitation(record: Record, k: int, fit: LawFit, tolerance: float) -> Finding | None:
    value, interval = fit.gains.get("pe", (1.0, 0.0))
    if abs(value - 1) <= max(interval, tolerance):
        return None
    return Finding("error", "law.excitation", f"By the log {value:.4g} +- {interval:.2g} times pe "
                   "is in the command.", "The robot was driven by another excitation than the "
                   "model would be.", "Correct the unit or the sign of pe.",
                   joint=record.joints[k])


def _not_understood(record: Record, robot: Robot, result: Replay, k: int) -> Finding:
    size = max(np.sqrt(np.mean(x[result.used, k] ** 2))
               for x in (record.signal("u"), result.u))
    steps = f", {result.lsb[k]:.3g} steps of its resolution" if result.lsb[k] > 0 else ""
    what = (f"The stated law leaves {result.rms[k] / size:.2%} of its command unexplained{steps} "
            f"(best velocity: {result.variant}).")
    if is_in_step(record, robot.controller):
        why = "Filter, sample time or law are not quite what is stated."
        fix = ("The diagnosis treats it as a gap in the controller; state the velocity filter to "
               "close it.")
    else:
        why = ("The log is not in step with the controller, so position and command of a row may "
               f"be up to {1e3 * record.sample_time:.3g} ms apart.")
        fix = ("Log in the controller's own cycle and state its sample_time_s; from this log the "
               "law cannot be proved to have run.")
    return Finding("warning", "law.residual", what, why, fix, joint=record.joints[k])
