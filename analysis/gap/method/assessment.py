"""Thresholds of the assessment: gap reduction, torque map, next experiment, ultimate bound."""

import dataclasses

from clie_blocks.analysis.gap.method.threshold import threshold


@dataclasses.dataclass(frozen=True)
class AssessmentMethod:
    """Thresholds of the assessment: gap reduction, torque map, next experiment, ultimate bound."""

    bootstrap_block: float = threshold(
        2.0, "s", "long against the memory of the loop, so that blocks are independent")
    reducible_from: float = threshold(
        1.02, "factor on the noise floor", "a smaller gap holds nothing that could be removed")
    earned_percent: float = threshold(
        10.0, "% of the reducible gap",
        "where a cause removes less on unseen data, nine tenths of the gap are something else")
    fold_block: float = threshold(
        2.0, "s", "least length of a block that is left out of a fit")
    fold_blocks: int = threshold(10, "blocks", "of a log that is long enough")
    fold_least_blocks: int = threshold(
        4, "blocks", "of a shorter log too little would be left to fit to")
    folds: int = threshold(5, "count", "of the cross-validation over blocks")
    fold_margin: float = threshold(
        0.5, "s", "on both sides of a block that is neither fitted nor predicted")
    refit_steps: int = threshold(
        2, "iterations", "enough from the fit to all blocks to the fit without one")

    map_positions: int = threshold(16, "knots", "of a torque map, over the range of motion")
    map_speeds: int = threshold(8, "knots", "of a torque map, over the range of speed")
    map_ridges: tuple[float, ...] = threshold(
        (1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0), "share of the mean square of a column",
        "ridges that are tried; the one that predicts best is taken")
    map_parts: int = threshold(
        4, "parts of each fit log", "a lap each where a motion is repeated")
    map_reversal_speed: float = threshold(
        0.02, "share of the largest speed", "slower motion counts as a reversal")
    map_settling: float = threshold(0.5, "s", "at the start of a log that is not fitted")
    map_rounds: int = threshold(3, "rounds", "after which motion and torque map agree")
    map_least_gap: float = threshold(
        1.5, "factor on the noise floor", "a joint with a smaller gap gets no map")
    map_least_percent: float = threshold(
        10.0, "% of the reducible gap", "a map that removes less is not worth its parameters")

    formula_terms: int = threshold(
        5, "terms", "at most, at each joint: what a reader still takes in, and a simulator holds")
    formula_waves: float = threshold(
        12.0, "waves over the travel", "the finest that a formula may hold beside those of motors")
    formula_highest: float = threshold(
        20.0, "Hz", "of a wave at the typical speed: what is faster hardly moves a joint")
    formula_corner: float = threshold(
        8.0, "Hz", "below it the measured motion, above it that of the model, which has no noise")
    formula_least_gain: float = threshold(
        0.03, "share of the squared gap", "that a term has to remove on parts left out")
    formula_steps: int = threshold(6, "iterations", "of the fit of the chosen terms in the loop")

    experiment_duration: float = threshold(20.0, "s", "of a recommended run")
    experiment_limit: float = threshold(
        0.9, "share of each limit", "that a recommended run may use")
    experiment_torque_growth: float = threshold(
        3.0, "times the largest torque of the logs",
        "that a recommended run may ask for: what a drive loses beyond it no log shows")
    experiment_least_torque: float = threshold(
        0.1, "share of the torque limit", "that a recommended run may ask for in any case")
    experiment_causes: int = threshold(
        4, "hypotheses", "that a recommended run is to tell apart, the most probable ones")
    experiment_least_gain: float = threshold(
        0.1, "causes fewer in the set, expected",
        "a run that would bring less leaves the set as it is nine times in ten")
    experiment_tries: int = threshold(
        6, "multisines", "that are tried after the first of each band")
    experiment_lines: int = threshold(10, "lines", "of a multisine")
    experiment_period: float = threshold(10.0, "s", "after which a multisine repeats")
    experiment_bands: tuple[tuple[float, float], ...] = threshold(
        ((0.1, 3.0), (0.1, 9.0), (1.0, 12.0)), "Hz", "of the multisines that are tried first")
    experiment_reference_shares: tuple[float, ...] = threshold(
        (0.8, 0.2), "share of a multisine's motion",
        "that comes from the reference rather than from the excitation")

    bound_band: float = threshold(
        5.0, "Hz", "above, the inverse of the sensitivity only amplifies noise")
    bound_quantile: float = threshold(
        0.99, "quantile", "of the modelling error that stands for its bound")
