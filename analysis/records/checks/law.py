"""Checks of the stated control law against the log: it is replayed, then regressed."""

import dataclasses

import numpy as np

from clie_blocks.analysis.records.checks.command import saturated
from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.measures import correlations, moves, permutation
from clie_blocks.analysis.records.control_law import stated_variant
from clie_blocks.analysis.records.replay import (
    in_steps,
    replay,
    settled,
    variants,
    velocity,
)
from clie_blocks.analysis.records.uncertainty import least_squares

DEGREE = 180 / np.pi
ROUNDING = 0.6  # steps of the command's resolution; rounding alone leaves 0.29
SMALL = 0.01  # share of the command's rms that clocks and float32 logs may leave
EXPLAINED = 0.3  # share of the residual that another law may leave to be the better one
LOOSE = 0.1  # share of the command beyond which a fitted law says nothing of its gains
GROSS = 0.25  # error of a gain that no velocity filter can feign
SHIFTS = (-3, -2, -1, 1, 2, 3)


@dataclasses.dataclass(frozen=True, eq=False)
class LawFit:
    """Control law of one joint as the log has it: value and 95 % half width by gain."""

    gains: dict
    rms: float
    variant: str


def check_law(record, robot):
    """Findings on gains, signs, order, timing and filter of the stated control law."""
    if not can_replay(record, robot):
        return []
    controller = robot.controller
    stated = stated_variant(controller)
    known = stated in variants(record, controller)
    result = compared(record, controller, stated if known else None)
    strange = unexplained(record, result)
    if not strange.any():
        return []
    best = compared(record, controller)
    if not unexplained(record, best).any():
        return [_variant(best, stated)]
    return (_swapped(record, result) or _shifted(record, result, strange)
            or [_joint(record, robot, result, k) for k in np.flatnonzero(strange)])


def can_replay(record, robot):
    """Whether law, command and reference are there."""
    return (robot is not None and robot.controller.law != "unknown" and record.u is not None
            and record.qd is not None and len(record) > 10)


def compared(record, controller, variant=None):
    """Replay of the law, its residual judged apart from samples with the command at its limit."""
    result = replay(record, controller, variant)
    apart = np.stack([result.used & ~saturated(record, None, k)[0] for k in range(record.n)], 1)
    if not apart.any(axis=0).all():
        return result
    rms = np.sqrt(np.mean(result.residual**2, axis=0, where=apart))
    return dataclasses.replace(result, rms=rms, lsb=in_steps(rms, controller))


def unexplained(record, result):
    """Mask of the joints at which a replay leaves more than rounding."""
    small = SMALL * np.sqrt(np.mean(record.u[result.used] ** 2, axis=0))
    return (result.rms > small) & ~(result.lsb < ROUNDING)


def fit_law(record, controller, k):
    """Regress the command of one joint on reference, position, velocity and excitation.

    Parameters
    ----------
    record : Record
        The log.
    controller : Controller
        Its velocity filter and limits; the gains are not used.
    k : int
        Joint.

    Returns
    -------
    LawFit or None
        Of all variants of the velocity the one that leaves least; None when nothing moves.

    """
    fits = [_fit(record, controller, k, variant) for variant in variants(record, controller)]
    return min((fit for fit in fits if fit), key=lambda fit: fit.rms, default=None)


def _fit(record, controller, k, variant):
    columns = {"qd": record.qd[:, k], "q": -record.q[:, k]}
    if variant != "none":
        columns["dq"] = -velocity(record, controller, variant)[:, k]
    if record.pe is not None:
        columns["pe"] = record.pe[:, k]
    used = settled(record, controller, variant) & np.isfinite(record.u[:, k])
    for column in columns.values():
        used &= np.isfinite(column)
    used &= ~saturated(record, None, k)[0]
    columns = {name: x[used] for name, x in columns.items() if moves(x[used])}
    if np.count_nonzero(used) < 100 or "q" not in columns:
        return None
    matrix = np.stack([x - x.mean() for x in columns.values()], axis=1)
    target = record.u[used, k] - record.u[used, k].mean()
    if np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0)) > 1e6:
        return None
    fit = least_squares(matrix, target)
    gains = dict(zip(columns, zip(fit.value, fit.interval, strict=True), strict=True))
    return LawFit(gains, float(np.sqrt(np.mean(fit.residual**2))), variant)


def _variant(best, stated):
    said = f"not {stated} as stated" if stated else "which was not stated"
    return Finding("warning", "law.variant", f"The controller's velocity is formed by "
                   f"'{best.variant}', {said}: with it the command is reproduced.",
                   "Another filter has another delay, which looks like inertia.",
                   f"State it: velocity_filter_discretisation or velocity_filter = "
                   f"\"{best.variant}\".")


def _swapped(record, result):
    """Commands that follow the law of another joint."""
    used = result.used
    logged, law = (x[used] - x[used].mean(axis=0) for x in (record.u, result.u))
    order = permutation(correlations(logged, law))
    if order is None:
        return []
    pairs = ", ".join(f"u of {record.joints[i]} is the command of {record.joints[j]}"
                      for i, j in enumerate(order) if i != j)
    return [Finding("error", "law.swapped", f"Commands are swapped: {pairs}.",
                    "Every joint would be given another's torque.",
                    f"Reorder the columns of u: permutation {[j + 1 for j in order]}.")]


def _shifted(record, result, strange):
    """A command that fits the law of a sample before or after."""
    rms = {shift: _shifted_rms(record, result, shift) for shift in SHIFTS}
    best = min(rms, key=lambda shift: np.sum(np.log(rms[shift][strange] + 1e-300)))
    if not np.all(rms[best][strange] < EXPLAINED * result.rms[strange]):
        return []
    side = "late" if best > 0 else "early"
    return [Finding("error", "law.shifted", f"The command is logged {abs(best)} sample"
                    f"{'s' if abs(best) > 1 else ''} {side} against the position: shifted back, "
                    f"the residual of the law falls from {result.rms.max():.3g} to "
                    f"{rms[best].max():.3g}.", "The shift looks like a delay of the robot.",
                    f"Shift u by {-best} samples, as for logs that put the command beside the "
                    "state that follows it.")]


def _shifted_rms(record, result, shift):
    moved = np.roll(record.u, -shift, axis=0)
    used = result.used.copy()
    used[:abs(shift)] = used[-abs(shift):] = False
    return np.sqrt(np.mean((moved[used] - result.u[used]) ** 2, axis=0))


def _joint(record, robot, result, k):
    fit = fit_law(record, robot.controller, k)
    if fit is None or fit.rms > EXPLAINED * result.rms[k]:
        return _not_understood(record, result, k)
    exact = fit.rms < max(_tolerated(record, robot.controller, result, k), 1e-300)
    if not exact and fit.rms > LOOSE * np.sqrt(np.mean(record.u[result.used, k] ** 2)):
        return _not_understood(record, result, k)
    return (_sign(record, k, fit) or _gain(record, robot, k, fit, 0.01 if exact else GROSS)
            or _excitation(record, k, fit, 0.01 if exact else GROSS)
            or _not_understood(record, result, k))


def _tolerated(record, controller, result, k):
    """Residual that rounding, or where the resolution is not stated a float32 log, leaves."""
    step = controller.command_resolution
    if step is not None and step[k] > 0:
        return ROUNDING * step[k]
    return SMALL * np.sqrt(np.mean(record.u[result.used, k] ** 2))


def _sign(record, k, fit):
    gains = {name: value for name, (value, _) in fit.gains.items()}
    wrong = [name for name in ("qd", "q") if gains.get(name, 1) < 0]
    if not wrong:
        return None
    which = {("qd", "q"): "u", ("q",): "u" if "qd" not in gains else "q", ("qd",): "qd"}
    signal = which[tuple(wrong)]
    return Finding("error", "law.sign", f"The log says that the gain on {' and '.join(wrong)} is "
                   "negative: a sign is wrong.", "Such a loop would run away, and the log does "
                   "not.", f"Turn {signal}: sign = -1 for {signal}_{record.joints[k]}.",
                   joint=record.joints[k])


def stated_gains(controller, k):
    """Stated gains of one joint by the signal on which they act, with their names."""
    kp = controller.kp[k]
    if controller.law == "cascade":
        return {"q": (kp * controller.kv[k], "Kp Kv"), "dq": (controller.kv[k], "Kv")}
    kd = None if controller.kd is None else controller.kd[k]
    return {"q": (kp, "Kp"), **({} if kd is None else {"dq": (kd, "Kd")})}


def _gain(record, robot, k, fit, tolerance):
    wrong = []
    for signal, (stated, name) in stated_gains(robot.controller, k).items():
        value, interval = fit.gains.get(signal, (stated, 0.0))
        if abs(value - stated) > max(interval, tolerance * abs(stated)):
            wrong.append((name, value, interval, stated))
    if not wrong:
        return None
    said = ", ".join(f"{name} = {value:.4g} +- {interval:.2g}, you said {stated:.4g}"
                     for name, value, interval, stated in wrong)
    ratios = [value / stated if stated else np.inf for _, value, _, stated in wrong]
    check, hint = _ratio(robot, k, ratios)
    return Finding("error", check, f"The log says {said}.", "With wrong gains the model's loop "
                   f"is not the robot's, and every estimate is off. {hint}".strip(),
                   "Correct [controller] in robot.toml.", joint=record.joints[k])


def _ratio(robot, k, ratios):
    """What a common ratio of all wrong gains points at."""
    gear = robot.motor.gear_ratio
    for factor, check, hint in (
            (DEGREE, "law.per_degree", "The factor is 57.3: the stated gains are per degree."),
            (1 / DEGREE, "law.per_degree", "The factor is 1/57.3: q is in degrees, or the stated "
             "gains are meant per degree."),
            *(((gear[k] ** power), "law.side", f"The factor is the gear ratio to the power "
               f"{power}: one is on the motor side, the other on the joint side.")
              for power in (1, -1, 2, -2) if gear is not None and gear[k] > 1.5)):
        if all(abs(ratio / factor - 1) < 0.05 for ratio in ratios):
            return check, hint
    return "law.gain", ""


def _excitation(record, k, fit, tolerance):
    value, interval = fit.gains.get("pe", (1.0, 0.0))
    if abs(value - 1) <= max(interval, tolerance):
        return None
    return Finding("error", "law.excitation", f"The log says that {value:.4g} +- {interval:.2g} "
                   "times pe is in the command.", "The robot was driven by another excitation "
                   "than the model would be.", "Correct the unit or the sign of pe.",
                   joint=record.joints[k])


def _not_understood(record, result, k):
    asked = max(np.sqrt(np.mean(x[result.used, k] ** 2)) for x in (record.u, result.u))
    share = result.rms[k] / asked
    steps = f", {result.lsb[k]:.3g} steps of its resolution" if result.lsb[k] > 0 else ""
    return Finding("warning", "law.residual", f"The stated law leaves {share:.2%} of its command "
                   f"unexplained{steps} (best velocity: {result.variant}).",
                   "Filter, sample time or law are not quite what is stated.",
                   "The diagnosis treats it as a gap in the controller; state the velocity filter "
                   "to close it.", joint=record.joints[k])
