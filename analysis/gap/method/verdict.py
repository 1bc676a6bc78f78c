"""Thresholds of the verdict: evidence, confounders, lack of fit, findings from signals."""

import dataclasses

from clie_blocks.analysis.gap.method.threshold import threshold


@dataclasses.dataclass(frozen=True)
class VerdictMethod:
    """Thresholds of the verdict, but for those that turn excess into odds (`Calibration`)."""

    prior_violation: float = threshold(
        9.0, "squared standard deviations",
        "a joint model that is farther from its datasheet speaks of a parametric mismatch")
    contradicting_gap: float = threshold(
        3.0, "squared gap over its floor, less one",
        "a larger gap on the validation logs contradicts a small excess")
    no_odds_factor: float = threshold(
        20.0, "factor on the least excess",
        "a hypothesis that leaves more has no odds to share, and no confounder is looked for")
    negligible_excess_share: float = threshold(
        1e-3, "share of the whole excess",
        "least excess that `no_odds_factor` applies to: differences below it do not count")
    no_odds_share: float = threshold(
        0.5, "share of the whole excess",
        "a hypothesis that leaves more has no odds against something unknown")

    synchronous_order: float = threshold(
        0.9, "waves per motor turn",
        "cogging and commutation have no less: one wave of them over the travel is enough")
    least_turns: float = threshold(
        4.0, "motor turns",
        "over which waves are seen to come a whole number of times per turn")
    off_whole_waves: float = threshold(
        0.02, "waves over the travel",
        "that may lack to a whole number of them per motor turn: any other torque has one in "
        "fifty by accident")
    repeated_waves: float = threshold(
        2.0, "waves over the travel",
        "a torque with longer waves than the motor's must repeat to be called periodic")
    least_passes: float = threshold(
        4.0, "passes of the travel",
        "of a friction that is uneven over the pose: over fewer, it may be one of time or load")
    seen_in_motion: float = threshold(
        0.5, "share of what waves over the pose explain",
        "while the joint moves: at rest they are a free torque at every pose")
    long_rests: float = threshold(
        0.3, "share of a log",
        "that a joint rests, from which on its rests may be what waves explain")
    resting: float = threshold(
        0.02, "share of the top speed", "below which a joint rests between two motions")
    acting_share: float = threshold(
        0.1, "share of the size at the joint that has most of it", "a joint with less is idle")
    yielding: float = threshold(
        2e-3, "share of the travel",
        "a contact that yields more shows by a torque that grows with the depth")

    right_before: float = threshold(
        0.3, "of what an effect explains per sample while it acts",
        "that a model may leave before a fault sets in or a limit is met: what is wrong before is "
        "something else")
    held_packets_leave: float = threshold(
        0.05, "of what held packets explain",
        "that they may leave: what they add is known to the sample from the logged commands")
    least_rows_before: int = threshold(
        100, "whitened samples",
        "before an effect acts: fewer, about a second, show little of what was there before")
    same_moment: float = threshold(
        0.3, "s", "between the onsets of one fault at several joints")
    away_from_ends: float = threshold(
        1.05, "s",
        "from an onset to the ends of a log: nearer, where none is sought, it is the start or the "
        "end itself")
    drift_left: float = threshold(
        0.5, "share of a drift",
        "that comes after the first second of a log: what is over by then is a start")
    least_periods: float = threshold(
        4.0, "periods in the longest log",
        "of a periodic disturbance: over fewer, a bend of the motion looks like one")
    most_weight: float = threshold(
        1.2, "times the weight of the stated links",
        "that a tilted base may bring about, with the tolerances of their masses")
    most_at_stop: float = threshold(
        0.7, "share of the time",
        "that a joint spends at its stops: more, and they are no ends of its range")

    free_torque_bumps: int = threshold(
        10, "count", "resolution of a free torque over the range of a signal")
    free_torque_ridges: tuple[float, ...] = threshold(
        (1e-6, 1e-4, 1e-2, 0.1), "on columns of norm one",
        "ridges that are tried; the one that predicts best is taken")
    free_torque_folds: int = threshold(
        4, "parts of each log", "each part is predicted from the others")
    free_torque_reversal_speed: float = threshold(
        0.05, "share of the RMS speed", "slower motion counts as a reversal")
    free_torque_speed_range: float = threshold(
        5.0, "factor on the RMS speed", "range of a free torque over the speed")

    unfinished_search: float = threshold(
        0.5, "probability",
        "that the cause is among what was fitted, where the time was over before the search was")
    unfinished_but_explained: float = threshold(
        0.7, "probability",
        "the same, where what was fitted leaves next to nothing: another cause may do so as well")
    delay_of_servo: float = threshold(
        0.75, "probability",
        "of a delay where a servo that goes to its set-points on a course of its own, of limited "
        "acceleration, would move alike: the rarer of the two")
    certain: float = threshold(
        0.97, "probability",
        "of what two logged signals, or the replay of the law, show without a model of the joint")
    quantization_share: float = threshold(
        0.7, "share of the sensor noise",
        "an encoder whose steps make more of its noise is reported as coarse")
    gain_error: float = threshold(
        0.01, "1", "a smaller error of the drive's gain is not reported")
