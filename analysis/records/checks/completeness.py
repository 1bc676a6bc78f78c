"""Checks of what is missing: masked samples, dead and stuck signals, coarse positions."""


import numpy as np

from clie_blocks.analysis.records.checks.finding import MOST_RANGES, Finding, ranges
from clie_blocks.analysis.records.checks.measures import longest_flat, step_size
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.repeatability import MAD_TO_STD, roughness
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.runs import runs
from clie_blocks.analysis.records.table import drop_pages

MOST_MASKED = 0.05
SHORT_RUN = 5
LEAST_RUN = 20
ABSURD = 1e9
LEAST_STEPS = 3  # a signal that moves by less is dead
SELDOM = 0.3  # share of equal neighbours up to which standing still is unusual for the signal
STUCK_STEPS = 30  # of travel by the velocity while the position stands
STUCK_SPEED = 0.5  # of the rms velocity, likewise; sensors at rest show less
COARSE = 0.1  # share of the rms velocity that one step of the position per sample may make


def check_missing(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on masked samples, on absurd values, and on signals with NaN or infinite values."""
    findings = [*_too_short(record), *_absurd(record)]
    share = 1 - record.valid.mean()
    if share > 0:
        where = ranges(~record.valid)
        longest = max(b - a for a, b in where)
        what = (f"{share:.2%} of the samples cannot be used, in {len(where)} runs, the longest "
                f"of {longest} samples.")
        if share > MOST_MASKED:
            findings.append(Finding("error", "missing.share", what, "Too much is missing to trust "
                                    "what is left.", "Repair the logger; nothing is filled in.",
                                    samples=where[:MOST_RANGES]))
        else:
            severity = "repair" if longest <= SHORT_RUN else "warning"
            findings.append(Finding(severity, "missing.samples", what, "Nothing is interpolated "
                                    "across them.", "They are masked; nothing to do.",
                                    samples=where[:MOST_RANGES]))
    findings += _lost_reference(record, robot)
    for name in ("qd", "pe", "dq", "tau"):
        for k, lost in _holes(getattr(record, name), record.valid):
            findings.append(Finding("warning", f"missing.{name}", f"{name} is NaN or infinite in "
                                    f"{lost} of {record.valid.sum()} usable samples.",
                                    f"What needs {name} is left out there.",
                                    "Log it at every sample.", joint=record.joints[k]))
    return findings


def _lost_reference(record: Record, robot: Robot | None) -> list[Finding]:
    if record.qd is not None or record.u is None or robot is None or robot.controller.kp is None:
        return []
    return [Finding("warning", "missing.qd", "The reference qd is not logged.", "The stated law "
                    "cannot be replayed, so it is trusted: the diagnosis reads the reference from "
                    "the command by it.", "Log qd at every sample.")]


def check_alive(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on joints that do not move, encoders that hang, and coarse positions."""
    return [finding for k in range(record.n) for finding in _joint(record, robot, k)]


def dead_joints(record: Record, robot: Robot | None) -> list[int]:
    """Indices of the joints that hold no information on the joint's motion."""
    return [k for k in range(record.n)
            if _is_dead(record.q[record.valid, k], _step(record, robot, k))]


def _too_short(record: Record) -> list[Finding]:
    longest = max((stop - start for start, stop in runs(record, least=1)), default=0)
    if longest >= LEAST_RUN:
        return []
    return [Finding("error", "missing.run", f"The longest run of usable samples has {longest}.",
                    f"Fewer than {LEAST_RUN} show nothing of a motion.",
                    "Log longer, or repair the export.")]


def _absurd(record: Record) -> list[Finding]:
    sizes = {name: _largest(getattr(record, name)) for name in record.signals}
    return [Finding("error", "signal.absurd", f"{name} has values up to {size:.3g}.",
                    "No robot has such values; the column is something else, or the file is "
                    "damaged.", f"Name the right column: --map {name}=COLUMN.")
            for name, size in sizes.items() if size > ABSURD]


def _largest(signal: np.ndarray) -> float:
    """Largest size of a signal's values, 0 where none is finite."""
    largest = 0.0
    for column in np.atleast_2d(signal.T):
        if np.isfinite(column).any():
            largest = max(largest, np.nanmax(column), -np.nanmin(column))
        drop_pages(signal)  # a long log's columns come from disk: one at a time
    return largest


def _holes(x: np.ndarray | None, valid: np.ndarray) -> list[tuple[int, int]]:
    """Joints whose signal is not finite in usable samples, and in how many."""
    if x is None:
        return []
    lost = np.count_nonzero(~np.isfinite(x) & valid[:, None], axis=0)
    return [(int(k), int(lost[k])) for k in np.flatnonzero(lost)]


def _step(record: Record, robot: Robot | None, k: int) -> float:
    """Step of the position: what the log shows, if on a lattice, else what is stated."""
    stated = robot.encoder.resolution if robot else None
    known = np.nan if stated is None or not stated[k] > 0 else stated[k]
    return np.fmax(known, step_size(record.q[:, k]))


def _is_dead(q: np.ndarray, step: float) -> bool:
    return q.size == 0 or np.ptp(q) < LEAST_STEPS * (step if np.isfinite(step) else 1e-12)


def _joint(record: Record, robot: Robot | None, k: int) -> list[Finding]:
    step, name = _step(record, robot, k), record.joints[k]
    q = record.q[record.valid, k]
    if _is_dead(q, step):
        return [Finding("warning", "signal.dead", f"Its position moves by only {np.ptp(q):.3g}.",
                        "A joint at rest shows nothing of its model.",
                        "It is left out; move it, or name its column with --map.", joint=name)]
    return [*_stuck(record, k, step), *_coarser(record, robot, k, step),
            *_quantised(record, k, step)]


def _stuck(record: Record, k: int, step: float) -> list[Finding]:
    """An encoder hangs when it is still although its noise, or the velocity, shows a motion."""
    q = record.q[:, k]
    flat, usual = longest_flat(q)
    length = flat[1] - flat[0]
    expected = np.log(len(record)) / -np.log(np.clip(usual, 1e-3, 1 - 1e-9))
    noisy = usual < SELDOM and not _unrest(q) < step  # a step of NaN: on no lattice
    silent = noisy and length > max(10 * expected, 0.1 / record.sample_time, 10)
    if not silent and not _contradicted(record, k, flat, step):
        return []
    at_end = q[flat[0]] in (np.nanmin(q), np.nanmax(q))
    what = "clipped or at an end stop" if at_end else "stuck"
    return [Finding("warning", "signal.clipped" if at_end else "signal.stuck",
                    f"Its position is {what}: {length} equal samples, although its noise or its "
                    "velocity shows that it moves.", "There the log does not show the joint.",
                    "Leave that range out, and look at the encoder's cable and range.",
                    joint=record.joints[k], samples=(flat,))]


def _unrest(q: np.ndarray) -> float:
    """Noise of a position where it changes; rounding alone makes less than one step of it."""
    second = np.abs(q[2:] - 2 * q[1:-1] + q[:-2])
    second = second[second > 0]
    return MAD_TO_STD * np.median(second) / np.sqrt(6) if second.size else 0.0


def _contradicted(record: Record, k: int, flat: tuple[int, int], step: float) -> bool:
    """Whether by the logged velocity the joint moved far while its position stood still."""
    if record.dq is None or not np.isfinite(step):
        return False
    dq = np.nan_to_num(record.dq[flat[0]:flat[1], k])
    travel = abs(np.sum(dq)) * record.sample_time
    usual = np.sqrt(np.mean(np.nan_to_num(record.dq[:, k]) ** 2))
    return travel > STUCK_STEPS * step and abs(dq.mean()) > STUCK_SPEED * usual


def _coarser(record: Record, robot: Robot | None, k: int, step: float) -> list[Finding]:
    stated = robot.encoder.resolution if robot else None
    if stated is None or not step > 1.5 * stated[k] > 0:
        return []
    return [Finding("warning", "signal.resolution", f"Its position comes in steps of {step:.4g}, "
                    f"robot.toml states {stated[k]:.4g}.", "The encoder, its gear or the export "
                    "is coarser than known.", "Correct [encoder], or export more digits; the "
                    "diagnosis considers it as a cause.", joint=record.joints[k])]


def _quantised(record: Record, k: int, step: float) -> list[Finding]:
    if not np.isfinite(step):
        return []
    q = record.q[:, k]
    usual = np.sqrt(np.nanmean((np.gradient(q)) ** 2)) / record.sample_time
    coarse = step / record.sample_time > COARSE * usual
    noise = roughness(record)[0][k]
    if not coarse or step / np.sqrt(12) < 0.5 * noise and step < 3 * noise:
        return []
    return [Finding("warning", "signal.quantised", f"Its position comes in steps of {step:.4g}, "
                    f"{step / record.sample_time:.3g} per second from one sample to the next.",
                    "The velocity from one step to the next is mostly rounding.",
                    f"Rounding counts as noise of {step / np.sqrt(12):.3g}; slow effects below "
                    "one step are out of reach.", joint=record.joints[k])]
