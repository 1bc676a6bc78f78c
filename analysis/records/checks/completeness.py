"""Checks of what is missing: masked samples, dead and stuck signals, coarse positions."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import MOST_RANGES, Finding, ranges
from clie_blocks.analysis.records.checks.measures import longest_flat, step_size
from clie_blocks.analysis.records.repeatability import roughness
from clie_blocks.analysis.records.runs import runs

MOST_MASKED = 0.05
SHORT_RUN = 5
LEAST_RUN = 20
ABSURD = 1e9
LEAST_STEPS = 3  # a signal that moves by less is dead
SELDOM = 0.3  # share of equal neighbours up to which standing still is no habit of the signal
STUCK_STEPS = 30  # of travel by the velocity while the position stands
STUCK_SPEED = 0.5  # of the rms velocity, likewise; sensors at rest show less
COARSE = 0.1  # share of the rms velocity that one step of the position per sample may make


def check_missing(record, robot):
    """Findings on masked samples, on absurd values, and on signals that hold no numbers."""
    found = [*_too_short(record), *_absurd(record)]
    share = 1 - record.valid.mean()
    if share > 0:
        where = ranges(~record.valid)
        longest = max(b - a for a, b in where)
        said = (f"{share:.2%} of the samples cannot be used, in {len(where)} runs, the longest "
                f"of {longest} samples.")
        if share > MOST_MASKED:
            found.append(Finding("error", "missing.share", said, "Too much is missing to trust "
                                 "what is left.", "Repair the logger; nothing is filled in.",
                                 samples=where[:MOST_RANGES]))
        else:
            severity = "repair" if longest <= SHORT_RUN else "warning"
            found.append(Finding(severity, "missing.samples", said, "Nothing is interpolated "
                                 "across them.", "They are masked; nothing to do.",
                                 samples=where[:MOST_RANGES]))
    for name in ("qd", "pe", "dq", "tau"):
        x = getattr(record, name)
        for k in _columns_with_holes(x, record.valid):
            found.append(Finding("warning", f"missing.{name}", f"{name} has values that are not "
                                 "numbers.", f"What needs {name} is left out there.",
                                 "Log it at every sample.", joint=record.joints[k]))
    return found


def check_alive(record, robot):
    """Findings on joints that do not move, encoders that hang, and coarse positions."""
    return [finding for k in range(record.n) for finding in _joint(record, robot, k)]


def dead_joints(record, robot):
    """Indices of the joints that hold no information on the joint's motion."""
    return [k for k in range(record.n)
            if _is_dead(record.q[record.valid, k], _step(record, robot, k))]


def _too_short(record):
    longest = max((stop - start for start, stop in runs(record, least=1)), default=0)
    if longest >= LEAST_RUN:
        return []
    return [Finding("error", "missing.run", f"The longest run of usable samples has {longest}.",
                    f"With fewer than {LEAST_RUN} nothing can be said of a motion.",
                    "Log longer, or repair the export.")]


def _absurd(record):
    sizes = {name: np.nanmax(np.abs(x), initial=0.0) for name in record.signals
             if np.isfinite(x := getattr(record, name)).any()}
    return [Finding("error", "signal.absurd", f"{name} has values up to {size:.3g}.",
                    "No robot has such values; the column is something else, or the file is "
                    "damaged.", f"Name the right column: --map {name}=COLUMN.")
            for name, size in sizes.items() if size > ABSURD]


def _columns_with_holes(x, valid):
    if x is None:
        return []
    return np.flatnonzero(~np.isfinite(x[valid]).all(axis=0))


def _step(record, robot, k):
    """Step of the position: what the log shows, if on a lattice, else what is stated."""
    stated = robot.encoder.resolution if robot else None
    known = np.nan if stated is None or not stated[k] > 0 else stated[k]
    return np.fmax(known, step_size(record.q[:, k]))


def _is_dead(q, step):
    return q.size == 0 or np.ptp(q) < LEAST_STEPS * (step if np.isfinite(step) else 1e-12)


def _joint(record, robot, k):
    step, name = _step(record, robot, k), record.joints[k]
    q = record.q[record.valid, k]
    if _is_dead(q, step):
        return [Finding("warning", "signal.dead", f"Its position moves by only {np.ptp(q):.3g}.",
                        "A joint at rest tells nothing of its model.",
                        "It is left out; move it, or name its column with --map.", joint=name)]
    return [*_stuck(record, k, step), *_coarser(record, robot, k, step),
            *_quantised(record, k, step)]


def _stuck(record, k, step):
    """An encoder hangs when it is still although its noise, or the velocity, says otherwise."""
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
                    f"Its position is {what}: {length} equal samples, though its noise or its "
                    "velocity says that it moves.", "There the log does not show the joint.",
                    "Leave that range out, and look at the encoder's cable and range.",
                    joint=record.joints[k], samples=(flat,))]


def _unrest(q):
    """Noise of a position where it changes; rounding alone makes less than one step of it."""
    bend = np.abs(q[2:] - 2 * q[1:-1] + q[:-2])
    bend = bend[bend > 0]
    return 1.4826 * np.median(bend) / np.sqrt(6) if bend.size else 0.0


def _contradicted(record, k, flat, step):
    """Whether the logged velocity says that the joint moved far while its position stood."""
    if record.dq is None or not np.isfinite(step):
        return False
    dq = np.nan_to_num(record.dq[flat[0]:flat[1], k])
    travel = abs(np.sum(dq)) * record.sample_time
    usual = np.sqrt(np.mean(np.nan_to_num(record.dq[:, k]) ** 2))
    return travel > STUCK_STEPS * step and abs(dq.mean()) > STUCK_SPEED * usual


def _coarser(record, robot, k, step):
    stated = robot.encoder.resolution if robot else None
    if stated is None or not step > 1.5 * stated[k] > 0:
        return []
    return [Finding("warning", "signal.resolution", f"Its position comes in steps of {step:.4g}, "
                    f"robot.toml states {stated[k]:.4g}.", "The encoder, its gear or the export "
                    "is coarser than known.", "Correct [encoder], or export more digits; the "
                    "diagnosis takes it as a candidate.", joint=record.joints[k])]


def _quantised(record, k, step):
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
